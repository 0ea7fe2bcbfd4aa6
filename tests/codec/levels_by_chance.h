// I-frames with levels that no encoder would write: any base, displaced and coloured at random.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "codec/intra/intra_frame.h"
#include "codec/intra/level_colours.h"
#include "codec/intra/leveled_frame.h"
#include "codec/intra/surface_levels_walk.h"
#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::test {

using namespace internal;

// A payload of levels, and the surface that it stands for.
struct LevelsByChance {
    std::vector<std::uint8_t> bytes;
    LeveledSurface surface;
};
// Two thirds of the displacements are none. most: of their magnitudes. Nothing where there would be more vertices.
inline std::optional<LevelsByChance> levels_by_chance(const LatticeMesh& base, const SurfaceLevels& levels,
                                                      std::int32_t most, std::size_t most_vertices,
                                                      std::mt19937& random) {
    MeshEdges finest;
    auto subdivision = subdivide(base, levels.depth, most_vertices, &finest);
    if (!subdivision) return std::nullopt;
    LevelsByChance out;
    auto& surface = out.surface;
    surface.triangles = base.triangles;
    surface.subdivision = std::move(*subdivision);
    std::vector<std::vector<std::uint8_t>> runs;
    DisplacementModels models;
    std::vector<std::int32_t> values;
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) {
        const auto* level = k > 0 ? &surface.subdivision[k - 1] : nullptr;
        const auto expected =
            level ? ExpectedLevel(*level, surface.positions, surface.triangles_above(k), levels.rules[k - 1])
                  : ExpectedLevel(base);
        RangeEncoder encoder;
        WritingCoder<RangeEncoder> coder{encoder};
        code_displacements(
            coder, models, level, k, expected, step_at(levels, k), surface, values,
            [&](std::size_t, const DisplacementContext&) {
                return random() % 3 == 0
                           ? static_cast<std::int32_t>(random() % (2u * static_cast<unsigned>(most) + 1)) - most
                           : 0;
            });
        runs.push_back(encoder.finish());
    }
    out.bytes = write_surface_levels(levels, runs);
    if (levels.rounded > 0 && !round_off(levels, finest, most_vertices, surface)) return std::nullopt;
    return out;
}

// The layer of colours of the detail's first levels; most are the means. Sets detail.colours.
inline std::vector<std::uint8_t> level_colours_by_chance(std::span<const Colour> colours, std::int32_t step,
                                                         std::size_t coded, std::int32_t most, SurfaceDetail& detail,
                                                         std::mt19937& random) {
    LevelColours known(colours);
    const auto models = std::make_unique<LevelColourModels>();
    const auto any = [&](const EdgeStencil&, const LevelColourContext&) {
        ColourDifference wanted{};
        if (random() % 3 == 0)
            for (auto& c : wanted)
                c = static_cast<std::int32_t>(random() % (2u * static_cast<unsigned>(most) + 1)) - most;
        return wanted;
    };
    std::vector<std::vector<std::uint8_t>> runs;
    for (std::size_t k = 0; k < coded; ++k) {
        RangeEncoder encoder;
        WritingCoder<RangeEncoder> coder{encoder};
        code_level_colours(coder, *models, k, step, known, detail, any);
        runs.push_back(encoder.finish());
    }
    return write_level_colours(runs);
}

// An I-frame's payload without a pose, and what decoders make of it.
struct LeveledByChance {
    FramePayload payload;
    LeveledFrame frame;
};
struct LeveledByChanceOptions {
    SurfaceLevels levels;
    std::uint32_t referred = 1;
    std::int32_t geometry_step = 6, colour_step = 9;
    std::int32_t most_displacement = 30;  // of a magnitude
    std::int32_t most_difference = 4;     // of colours
    bool colours = true, normals = false, level_colours = true;
};
// base: its positions and triangles. Nothing where a frame must not have so much detail.
inline std::optional<LeveledByChance> leveled_by_chance(const LatticeMesh& base, const LeveledByChanceOptions& options,
                                                        std::mt19937& random) {
    LeveledByChance out;
    auto& payload = out.payload;
    LatticeMesh shape;
    // A grid point beyond the last that is on the lattice is an error.
    const auto end = lattice_limit / options.geometry_step * options.geometry_step;
    for (const auto p : base.positions)
        shape.positions.push_back({std::clamp(p.x, -end, end), std::clamp(p.y, -end, end), std::clamp(p.z, -end, end)});
    shape.triangles = base.triangles;
    IntraFrameOptions intra;
    intra.geometry_step = options.geometry_step;
    intra.merge_duplicates = false;
    const auto coded = encode_intra_frame(shape, intra, payload);
    if (!coded) return std::nullopt;
    auto levels = levels_by_chance(*coded, options.levels, options.most_displacement, 1 << 16, random);
    if (!levels) return std::nullopt;
    payload.set(Layer::levels, write_levels_layer(options.referred, {payload.header.vertices, payload.header.triangles},
                                                  levels->bytes));
    const auto vertices = levels->surface.positions.size();
    std::size_t most_triangles = 0;
    for (std::size_t k = 1; k <= levels->surface.subdivision.size() + 1; ++k)
        most_triangles = std::max(most_triangles, levels->surface.triangles_above(k).size());
    out.frame = leveled_frame(options.levels, std::move(levels->surface), options.referred);
    auto& [mesh, detail] = out.frame;
    const auto most = (most_detail + 1) * mesh.positions.size();
    if (vertices > most || most_triangles > 4 * most) return std::nullopt;
    payload.header.vertices = static_cast<std::uint32_t>(mesh.positions.size());
    payload.header.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    payload.header.intra_coder = intra_coder_levels;
    if (options.colours)
        for (std::size_t v = 0; v < mesh.positions.size(); ++v)
            mesh.colours.push_back({static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(v), 100});
    if (options.normals)
        for (const auto& n : vertex_normals(mesh.positions, mesh.triangles))
            mesh.normals.push_back({static_cast<std::int32_t>(n[0] * 127), static_cast<std::int32_t>(n[1] * 127),
                                    static_cast<std::int32_t>(n[2] * 127)});
    if (!encode_intra_attributes(mesh, options.colour_step, payload)) return std::nullopt;
    if (options.level_colours && !mesh.colours.empty() && !detail.empty())
        payload.set(Layer::level_colours,
                    level_colours_by_chance(
                        mesh.colours, options.colour_step,
                        options.levels.depth.levels - std::min(options.referred, options.levels.depth.levels),
                        options.most_difference, detail, random));
    return out;
}

// The mesh that frames refer to, of an I-frame of any kind that this library codes by itself.
inline LatticeMesh coded_mesh(const FramePayloadView& payload) {
    if (payload.header.intra_coder == intra_coder_levels) return decode_leveled_frame(payload, 1 << 22)->mesh;
    return *decode_intra_frame(payload, nullptr);
}

}  // namespace htvm::test
