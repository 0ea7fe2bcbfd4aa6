#include "codec/encoder/surface_levels.h"

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

}  // namespace

Result<EncodedSurfaceLevels> encode_surface_levels(const SurfaceIndex& captured, const LatticeMesh& base,
                                                   const SurfaceLevelsOptions& options) {
    EncodedSurfaceLevels out;
    const auto& levels = options.levels;
    const auto whole = subdivide(base, levels.depth, most_vertices);
    if (!whole) return fail(ErrorKind::limit, "surface levels: more vertices than can be coded; ask for longer edges");
    const auto& subdivision = *whole;
    SurfaceFit fit(captured, base, subdivision, levels, options.fit);
    fit.improve(0, options.rounds);
    std::vector<std::int32_t> values;
    DisplacementModels models;
    auto& positions = out.surface.positions;
    std::vector<std::vector<std::uint8_t>> runs;
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) {
        const auto* level = k > 0 ? &subdivision[k - 1] : nullptr;
        const auto& above = k > 1 ? subdivision[k - 2].triangles : base.triangles;
        const auto expected =
            level ? ExpectedLevel(*level, positions, above, levels.rules[k - 1]) : ExpectedLevel(base);
        const std::size_t first = positions.size();
        const auto step = step_at(levels, k);
        const double in_steps = (1 << displacement_bits) / static_cast<double>(step);
        const double weight = static_cast<double>(step) * step / (static_cast<double>(levels.step) * levels.step);
        std::size_t moved = 0;
        RangeEncoder encoder;
        WritingCoder<RangeEncoder> coder{encoder};
        code_displacements(coder, models, level, k, expected, step, positions, values,
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
        out.parts.push_back({positions.size() - first, moved, runs.back().size()});
    }
    out.payload = write_surface_levels(levels, runs);
    out.surface.triangles = subdivision.empty() ? base.triangles : subdivision.back().triangles;
    return out;
}

}  // namespace htvm::internal
