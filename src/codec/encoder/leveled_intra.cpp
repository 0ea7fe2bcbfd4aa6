#include "codec/encoder/leveled_intra.h"

#include <algorithm>
#include <cmath>

#include "codec/encoder/leveled_base.h"
#include "codec/encoder/surface_levels_fit.h"
#include "codec/intra/duplicates.h"
#include "codec/intra/intra_frame.h"

namespace htvm::internal {
namespace {

// As a header can hold it.
std::uint32_t in_header(double x) {
    constexpr double most = 1 << 20;
    return static_cast<std::uint32_t>(std::lround(std::clamp(x, 1.0, most)));
}

}  // namespace

Result<LeveledIntra> encode_leveled_intra(const LatticeMesh& captured, const LeveledIntraOptions& options) {
    LatticeMesh geometry;
    geometry.positions = captured.positions;
    geometry.triangles = captured.triangles;
    const auto whole = welded(geometry, at_same_place(geometry));
    if (whole.triangles.empty()) return fail(ErrorKind::bad_input, "a mesh without triangles has no surface to level");
    const auto sampled = evenly_sampled(whole, options.threads);
    const SubdivisionDepth depth{options.levels, in_header(options.longest_edge * options.step.value)};
    LeveledBaseOptions base_options;
    base_options.surface_error = options.base_error * options.step;
    base_options.again = options.base_again;
    base_options.depth = depth;
    base_options.rule = options.rule;
    base_options.step = options.step;
    base_options.threads = options.threads;
    const auto base = leveled_base(whole, sampled, base_options);
    LeveledIntra out;
    IntraFrameOptions intra;
    intra.geometry_step = static_cast<std::int32_t>(in_header(options.base_step * options.step.value));
    intra.merge_duplicates = false;  // vertices that fall together would join sheets that do not touch
    intra.threads = options.threads;
    auto decoded = encode_intra_frame(base, intra, out.base);
    if (!decoded) return tl::unexpected(decoded.error());
    out.decoded_base = std::move(*decoded);
    SurfaceLevelsOptions levels;
    levels.levels.depth = depth;
    levels.levels.step = in_header(options.step.value * (1 << displacement_bits));
    levels.levels.coarser = options.coarser;
    levels.levels.rounded = static_cast<std::uint32_t>(std::clamp(std::lround(32 * options.rounded), 0L, 255L));
    levels.levels.rules.fill(options.rule);
    levels.lambda = options.lambda;
    levels.rounds = options.rounds;
    levels.fit.choices = options.choices;
    levels.fit.least_moved = options.least_moved;
    levels.fit.threads = options.threads;
    out.settings = levels.levels;
    auto encoded = encode_surface_levels(sampled, out.decoded_base, levels);
    if (!encoded) return tl::unexpected(encoded.error());
    out.levels = std::move(*encoded);
    return out;
}

LeveledFrame put_leveled_intra(LeveledIntra coded, std::uint32_t referred, FramePayload& payload) {
    payload.header = coded.base.header;
    for (const auto layer : {Layer::fans, Layer::geometry}) payload.set(layer, coded.base.of(layer));
    payload.set(Layer::levels, write_levels_layer(referred, {coded.base.header.vertices, coded.base.header.triangles},
                                                  coded.levels.payload));
    auto out = leveled_frame(coded.settings, std::move(coded.levels.surface), referred);
    payload.header.vertices = static_cast<std::uint32_t>(out.mesh.positions.size());
    payload.header.triangles = static_cast<std::uint32_t>(out.mesh.triangles.size());
    payload.header.intra_coder = intra_coder_levels;
    return out;
}

}  // namespace htvm::internal
