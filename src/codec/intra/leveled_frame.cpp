#include "codec/intra/leveled_frame.h"

#include <algorithm>
#include <utility>

#include "codec/intra/intra_frame.h"
#include "codec/intra/level_colours.h"
#include "core/bytes.h"

namespace htvm::internal {
namespace {

auto corrupt(const char* what) { return fail(ErrorKind::corrupt_stream, std::string("I-frame: ") + what); }

std::uint32_t levels_below(const SurfaceLevels& levels, std::uint32_t referred) {
    return levels.depth.levels - std::min(referred, levels.depth.levels);
}

// The layer, decoded.
struct DecodedLevels {
    SurfaceLevelsHeader header;
    std::uint32_t referred = 0;
    std::size_t base_vertices = 0;
    LeveledSurface surface;
};

Result<DecodedLevels> decode_levels(const FramePayloadView& payload, std::size_t most_vertices, Threads threads) {
    const auto layer = payload.of(Layer::levels);
    ByteReader in(layer);
    const std::uint32_t referred = in.u8();
    const std::uint64_t vertices = in.varint(), triangles = in.varint();
    if (!in.ok() || referred > most_levels) return corrupt("the layer of its levels is cut off, or names one too many");
    const auto& counts = payload.header;
    if (vertices > counts.vertices || triangles > counts.triangles) return corrupt("its base is larger than its mesh");
    FramePayloadView of_base;
    of_base.header = counts;
    of_base.header.vertices = static_cast<std::uint32_t>(vertices);
    of_base.header.triangles = static_cast<std::uint32_t>(triangles);
    of_base.header.intra_coder = intra_coder_tfan;
    for (const auto coded : {Layer::fans, Layer::geometry}) {
        const auto i = static_cast<std::size_t>(coded);
        of_base.layers[i] = payload.layers[i];
        of_base.present[i] = payload.present[i];
    }
    const auto base = decode_intra_frame(of_base, nullptr, threads);
    if (!base) return tl::unexpected(base.error());
    const auto runs = layer.subspan(in.position());
    auto header = read_levels_header(runs);
    if (!header) return tl::unexpected(header.error());
    const auto most = std::min<std::uint64_t>(most_vertices, std::uint64_t{most_detail + 1} * counts.vertices);
    auto surface = decode_surface_levels(runs, *base, static_cast<std::size_t>(most));
    if (!surface) return tl::unexpected(surface.error());
    return DecodedLevels{std::move(*header), referred, static_cast<std::size_t>(vertices), std::move(*surface)};
}

}  // namespace

LeveledFrame leveled_frame(const SurfaceLevels& levels, LeveledSurface surface, std::uint32_t referred) {
    LeveledFrame out;
    const auto last = std::min<std::size_t>(referred, surface.subdivision.size());
    const auto vertices =
        last < surface.subdivision.size() ? surface.subdivision[last].first : surface.positions.size();
    out.mesh.triangles = surface.triangles_above(last + 1);
    out.mesh.positions = std::move(surface.positions);
    out.mesh.positions.resize(vertices);
    auto& detail = out.detail;
    for (std::size_t k = last; k < surface.subdivision.size(); ++k) {
        detail.levels.push_back(std::move(surface.subdivision[k]));
        detail.rules.push_back(levels.rules[k]);
    }
    detail.displacements.assign(surface.displacements.begin() + static_cast<std::ptrdiff_t>(vertices),
                                surface.displacements.end());
    if (detail.displacements.empty()) detail = {};
    return out;
}

std::vector<std::uint8_t> write_levels_layer(std::uint32_t referred, CapturedCounts base,
                                             std::span<const std::uint8_t> payload) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>(referred));
    out.varint(base.vertices);
    out.varint(base.triangles);
    out.bytes(payload);
    return out.take();
}

Result<LeveledFrame> decode_leveled_frame(const FramePayloadView& payload, std::size_t most_vertices, Threads threads) {
    auto decoded = decode_levels(payload, most_vertices, threads);
    if (!decoded) return tl::unexpected(decoded.error());
    const auto& counts = payload.header;
    const auto& levels = decoded->header.levels;
    auto out = leveled_frame(levels, std::move(decoded->surface), decoded->referred);
    if (out.mesh.positions.size() != counts.vertices || out.mesh.triangles.size() != counts.triangles)
        return corrupt("its mesh is not what its header says");
    if (auto ok = decode_intra_attributes(payload, out.mesh, threads); !ok) return tl::unexpected(ok.error());
    if (!payload.has(Layer::level_colours)) return out;
    if (out.mesh.colours.empty() || out.detail.empty()) return corrupt("it has colours of levels that it has not");
    if (auto ok = decode_level_colours(payload.of(Layer::level_colours), out.mesh.colours,
                                       static_cast<std::int32_t>(counts.colour_step),
                                       levels_below(levels, decoded->referred), out.detail);
        !ok)
        return tl::unexpected(ok.error());
    return out;
}

Result<std::vector<LevelShare>> level_shares(const FramePayloadView& payload, std::size_t most_vertices) {
    std::vector<LevelShare> out;
    if (payload.header.intra_coder != intra_coder_levels) return out;
    const auto decoded = decode_levels(payload, most_vertices, {});
    if (!decoded) return tl::unexpected(decoded.error());
    const auto& [header, referred, base_vertices, surface] = *decoded;
    const std::size_t coded = header.levels.depth.levels, last = std::min<std::size_t>(referred, coded);
    out.resize(1 + surface.subdivision.size());
    out[0] = {base_vertices, payload.of(Layer::fans).size() + payload.of(Layer::geometry).size(), 0, true};
    for (std::size_t k = 0; k <= coded; ++k)
        out[k].bytes += header.ends[k] - (k > 0 ? header.ends[k - 1] : header.first_run);
    for (std::size_t k = 1; k < out.size(); ++k) {
        out[k].vertices = surface.subdivision[k - 1].stencils.size();
        out[k].referred = k <= referred;
    }
    out[last].colour_bytes = payload.of(Layer::colour).size();
    if (!payload.has(Layer::level_colours)) return out;
    const auto runs = level_colour_runs(payload.of(Layer::level_colours), coded - last);
    if (!runs) return tl::unexpected(runs.error());
    for (std::size_t k = last + 1; k <= coded; ++k) out[k].colour_bytes = runs->sizes[k - last - 1];
    return out;
}

}  // namespace htvm::internal
