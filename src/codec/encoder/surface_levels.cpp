#include "codec/encoder/surface_levels.h"

#include <algorithm>
#include <cmath>

#include "codec/intra/surface_levels_walk.h"
#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

constexpr std::size_t most_vertices = std::size_t{1} << 24;

// The bits of a decision predicted from several contexts.
template <std::size_t N>
double mixed_cost(const Mixer<N>& mixer, const std::array<BinaryModel*, N>& models, bool bit) {
    const auto odds = mixed_log_odds(mixer, models);
    return decision_cost(BinaryModel{probability_table[static_cast<std::size_t>(odds + 2047)].coded, 0}, bit);
}

// The bits of a quantised displacement.
double cost_of(DisplacementModels& m, const DisplacementContext& c, std::int32_t value) {
    using namespace displacement_detail;
    double bits = mixed_cost(m.nonzero_mixer[c.level], nonzero(m, c), value != 0);
    if (value == 0) return bits;
    bits += mixed_cost(m.sign_mixer[c.level], negative(m, c), value < 0);
    const auto rest = static_cast<std::size_t>(std::abs(value)) - 1;
    for (std::size_t i = 0; i < DisplacementModels::unary && i <= rest; ++i)
        bits += mixed_cost(m.more_mixer[i], more(m, c, i), rest > i);
    if (rest >= DisplacementModels::unary)
        bits += 2 * std::log2(static_cast<double>(rest - DisplacementModels::unary) + 1) + 1;
    return bits;
}

// The value that is worth its bits, for a displacement of so many steps. weight: of a squared step.
std::int32_t chosen_value(DisplacementModels& models, const DisplacementContext& context, double steps, double weight,
                          double lambda) {
    const auto nearest = static_cast<std::int32_t>(std::lround(std::clamp(steps, -1e5, 1e5)));
    std::int32_t best = 0;
    double least = weight * steps * steps + lambda * cost_of(models, context, 0);
    for (const auto candidate : {nearest, nearest - (nearest > 0) + (nearest < 0)}) {
        if (candidate == 0) continue;
        const double off = steps - candidate;
        const double price = weight * off * off + lambda * cost_of(models, context, candidate);
        if (price < least) least = price, best = candidate;
    }
    return best;
}

// The fit sees the level that rounds off as if it split every edge that is long enough. False if these are too many.
bool add_all_rounded(const LatticeMesh& base, const SurfaceLevels& levels, const MeshEdges& finest,
                     std::vector<SubdivisionLevel>& subdivision) {
    auto flat = places_of(base.positions);
    for (const auto& level : subdivision) add_middles(level, flat);
    std::vector<std::uint8_t> split;
    for (const auto& [a, b] : finest.ends) {
        const Vector3d side = (flat[b] - flat[a]) * 2;
        split.push_back(dot(side, side) > static_cast<double>(levels.depth.longest_edge) * levels.depth.longest_edge);
    }
    auto level = split_edges(flat, subdivision.empty() ? base.triangles : subdivision.back().triangles, finest, split,
                             most_vertices);
    if (level) subdivision.push_back(std::move(*level));
    return level.has_value();
}

}  // namespace

Result<EncodedSurfaceLevels> encode_surface_levels(const SurfaceIndex& captured, const LatticeMesh& base,
                                                   const SurfaceLevelsOptions& options) {
    EncodedSurfaceLevels out;
    const auto& levels = options.levels;
    MeshEdges finest;
    auto whole = subdivide(base, levels.depth, most_vertices, &finest);
    if (!whole || (levels.rounded > 0 && !add_all_rounded(base, levels, finest, *whole)))
        return fail(ErrorKind::limit, "surface levels: more vertices than can be coded; ask for longer edges");
    const auto above = [&](std::size_t k) -> const std::vector<Triangle>& {
        return k < 2 ? base.triangles : (*whole)[k - 2].triangles;
    };
    SurfaceFit fit(captured, base, *whole, levels, levels.depth.levels, options.fit);
    fit.improve(0, options.rounds);
    std::vector<std::int32_t> values;
    DisplacementModels models;
    auto& surface = out.surface;
    surface.triangles = base.triangles;
    std::vector<std::vector<std::uint8_t>> runs;
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) {
        const auto* level = k > 0 ? &(*whole)[k - 1] : nullptr;
        const auto expected =
            level ? ExpectedLevel(*level, surface.positions, above(k), levels.rules[k - 1]) : ExpectedLevel(base);
        const std::size_t first = surface.positions.size();
        const auto step = step_at(levels, k);
        const double in_steps = (1 << displacement_bits) / static_cast<double>(step);
        const double weight = static_cast<double>(step) * step / (static_cast<double>(levels.step) * levels.step);
        std::size_t moved = 0;
        RangeEncoder encoder;
        WritingCoder<RangeEncoder> coder{encoder};
        code_displacements(coder, models, level, k, expected, step, surface, values,
                           [&](std::size_t i, const DisplacementContext& context) {
                               const std::size_t v = first + i;
                               const auto value =
                                   chosen_value(models, context, fit.displacements()[v] * in_steps,
                                                weight * std::clamp(fit.weights()[v], 0.25, 64.0), options.lambda);
                               moved += value != 0;
                               fit.set(v, value / in_steps);
                               return value;
                           });
        if (k < levels.depth.levels) fit.improve(k + std::size_t{1}, 1);
        runs.push_back(encoder.finish());
        out.parts.push_back({surface.positions.size() - first, moved, runs.back().size()});
    }
    out.payload = write_surface_levels(levels, runs);
    whole->resize(levels.depth.levels);
    surface.subdivision = std::move(*whole);
    if (levels.rounded > 0) {
        const auto before = surface.positions.size();
        if (!round_off(levels, finest, most_vertices, surface))
            return fail(ErrorKind::limit, "surface levels: more vertices than can be coded; ask for a larger bend");
        out.parts.push_back({surface.positions.size() - before, 0, 0});
    }
    return out;
}

}  // namespace htvm::internal
