#include "codec/intra/surface_levels.h"

#include "codec/intra/surface_levels_walk.h"
#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

constexpr std::uint64_t most_in_header = 1 << 20;  // of the longest edge and of the step
constexpr std::uint64_t most_run = 1 << 28;        // bytes: all runs together stay below 2^32

// The class of a magnitude or of a sum of some, growing with its logarithm.
std::size_t magnitude_class(std::uint64_t quarters, std::size_t classes) {
    constexpr std::array<std::uint32_t, 8> above = {0, 2, 4, 7, 11, 18, 32, 60};
    std::size_t out = 0;
    for (const auto threshold : above) out += quarters > threshold;
    return std::min(out, classes - 1);
}

std::size_t bend_class(double squared, std::uint32_t step) {
    // In eighths of the step, squared: classes are a factor of two apart, without a root.
    const double unit = static_cast<double>(step) / (8 << displacement_bits);
    const double in_eighths = squared / (unit * unit);
    std::size_t out = 0;
    for (double limit = 1; out + 1 < DisplacementContext::bends && in_eighths >= limit; limit *= 4) ++out;
    return out;
}

}  // namespace

std::uint32_t step_at(const SurfaceLevels& levels, std::uint32_t level) {
    std::uint32_t step = levels.step;
    for (std::uint32_t k = levels.depth.levels; k > level; --k) step = (step * levels.coarser + 8) / 16;
    return std::max(step, 1u);
}

DisplacementContext displacement_context(const SubdivisionLevel& level, std::size_t i, std::uint32_t number,
                                         std::span<const std::int32_t> values, double bent, std::uint32_t step) {
    DisplacementContext out;
    out.level = std::min<std::size_t>(number, DisplacementContext::levels - 1);
    const auto magnitude = [&](std::uint32_t v) {
        return static_cast<std::uint64_t>(std::min(std::abs(values[v]), 64));
    };
    const auto& stencil = level.stencils[i];
    std::uint64_t above = 2 * (magnitude(stencil.a) + magnitude(stencil.b));
    for (const auto v : stencil.across)
        if (v != no_element) above += magnitude(v);
    out.above = magnitude_class(above, DisplacementContext::aboves);
    std::uint64_t sum = 0;
    std::int64_t signed_sum = 0, count = 0;
    for (const auto v : level.beside[i]) {
        if (v == no_element) break;
        ++count;
        sum += magnitude(v);
        signed_sum += std::clamp(values[v], -64, 64);
    }
    if (count > 0) {
        out.beside = 1 + magnitude_class(4 * sum / static_cast<std::uint64_t>(count), DisplacementContext::besides - 1);
        const std::int64_t mean = 2 * signed_sum / count;
        const std::int64_t size = mean == 0 ? 0 : std::abs(mean) < 2 ? 1 : std::abs(mean) < 5 ? 2 : 3;
        out.trend = static_cast<std::size_t>(3 + (mean < 0 ? -size : size));
    }
    out.bend = bend_class(bent, step);
    return out;
}

std::vector<std::uint8_t> write_surface_levels(const SurfaceLevels& levels,
                                               std::span<const std::vector<std::uint8_t>> runs) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>(levels.depth.levels | (levels.coarser - 1) << 4));
    out.varint(levels.depth.longest_edge - 1);
    out.varint(levels.step - 1);
    out.u8(static_cast<std::uint8_t>(levels.rounded));
    for (std::uint32_t k = 0; k < levels.depth.levels + (levels.rounded > 0 ? 1 : 0); ++k)
        out.u8(static_cast<std::uint8_t>(levels.rules[k].butterfly | levels.rules[k].tangents << 4));
    for (const auto& run : runs) out.varint(run.size());
    for (const auto& run : runs) out.bytes(run);
    return out.take();
}

Result<SurfaceLevelsHeader> read_levels_header(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    SurfaceLevelsHeader out;
    auto& levels = out.levels;
    const std::uint32_t first = in.u8();
    levels.depth.levels = first & 15;
    levels.coarser = (first >> 4) + 1;
    const std::uint64_t longest = in.varint(), step = in.varint();
    if (levels.depth.levels > most_levels || longest >= most_in_header || step >= most_in_header)
        return fail(ErrorKind::corrupt_stream, "surface levels: a number is out of range");
    levels.depth.longest_edge = static_cast<std::uint32_t>(longest) + 1;
    levels.step = static_cast<std::uint32_t>(step) + 1;
    levels.rounded = in.u8();
    for (std::uint32_t k = 0; k < levels.depth.levels + (levels.rounded > 0 ? 1 : 0); ++k) {
        const std::uint32_t rule = in.u8();
        levels.rules[k] = {rule & 15, rule >> 4};
    }
    std::array<std::uint64_t, most_levels + 1> sizes{};
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) {
        sizes[k] = in.varint();
        if (sizes[k] > most_run) return fail(ErrorKind::corrupt_stream, "surface levels: a run is too long");
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "surface levels: the header is cut off");
    std::size_t end = out.first_run = in.position();
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) out.ends[k] = end += static_cast<std::size_t>(sizes[k]);
    if (payload.size() > end) return fail(ErrorKind::corrupt_stream, "surface levels: bytes follow the last run");
    return out;
}

bool round_off(const SurfaceLevels& levels, const MeshEdges& edges, std::size_t most_vertices,
               LeveledSurface& surface) {
    const auto& triangles = surface.finest();
    const double least = displacement_of(static_cast<std::int32_t>(levels.rounded), levels.step) / 32;
    auto level = split_edges(places_of(surface.positions), triangles, edges,
                             bent_edges(surface.positions, vertex_normals(surface.positions, triangles), edges, least),
                             most_vertices);
    if (!level) return false;
    const ExpectedLevel expected(*level, surface.positions, triangles, levels.rules[levels.depth.levels]);
    surface.positions.reserve(surface.positions.size() + expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
        surface.positions.push_back(displaced_vertex(expected.vertex(i).at, {}, 0));
    surface.displacements.resize(surface.positions.size(), 0);
    surface.subdivision.push_back(std::move(*level));
    return true;
}

Result<LeveledSurface> decode_surface_levels(std::span<const std::uint8_t> payload, const LatticeMesh& base,
                                             std::size_t most_vertices, std::uint32_t down_to) {
    const auto header = read_levels_header(payload);
    if (!header) return tl::unexpected(header.error());
    const auto& levels = header->levels;
    const std::uint32_t last = std::min(down_to, levels.depth.levels);
    const bool rounds = levels.rounded > 0 && down_to > levels.depth.levels;
    if (payload.size() < header->ends[last]) return fail(ErrorKind::corrupt_stream, "surface levels: a run is cut off");
    const auto too_many = [] { return fail(ErrorKind::limit, "surface levels: more vertices than may be decoded"); };
    // The first levels are those of a surface that has no more.
    MeshEdges finest;
    auto subdivision = subdivide(base, {last, levels.depth.longest_edge << (levels.depth.levels - last)}, most_vertices,
                                 rounds ? &finest : nullptr);
    if (!subdivision) return too_many();
    LeveledSurface out;
    out.triangles = base.triangles;
    out.subdivision = std::move(*subdivision);
    std::vector<std::int32_t> values;
    DisplacementModels models;
    std::size_t begin = header->first_run;
    for (std::uint32_t k = 0; k <= last; ++k) {
        RangeDecoder decoder(payload.subspan(begin, header->ends[k] - begin));
        begin = header->ends[k];
        ReadingCoder<RangeDecoder> coder{decoder};
        const auto* level = k > 0 ? &out.subdivision[k - 1] : nullptr;
        const auto expected = level ? ExpectedLevel(*level, out.positions, out.triangles_above(k), levels.rules[k - 1])
                                    : ExpectedLevel(base);
        code_displacements(coder, models, level, k, expected, step_at(levels, k), out, values,
                           [](std::size_t, const DisplacementContext&) { return 0; });
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "surface levels: a run ends too early");
    }
    if (rounds && !round_off(levels, finest, most_vertices, out)) return too_many();
    return out;
}

}  // namespace htvm::internal
