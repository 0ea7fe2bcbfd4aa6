#include "codec/encoder/surface_levels.h"

#include <cmath>

#include "codec/intra/surface_levels_walk.h"
#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// The bits of a decision predicted from several contexts, without adapting them.
template <std::size_t N>
double mixed_cost(const Mixer<N>& mixer, const std::array<const BinaryModel*, N>& models, bool bit) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < N; ++i) sum += std::int64_t{log_odds_table[models[i]->one >> 4]} * mixer.weights[i];
    const auto odds = static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -2047, 2047));
    return decision_cost(BinaryModel{probability_table[static_cast<std::size_t>(odds + 2047)].coded, 0}, bit);
}

// The bits of a quantised displacement.
double cost_of(const DisplacementModels& m, const DisplacementContext& c, std::int32_t value) {
    using C = DisplacementContext;
    const auto at_level = [&](std::size_t classes, std::size_t own) { return c.level * classes + own; };
    double bits = mixed_cost<5>(m.nonzero_mixer[c.level],
                                {&m.by_beside[at_level(C::besides, c.beside)], &m.by_above[at_level(C::aboves, c.above)],
                                 &m.by_both[c.beside * C::aboves + c.above], &m.by_bend[at_level(C::bends, c.bend)],
                                 &m.by_trend[c.trend * C::bends + c.bend]},
                                value != 0);
    if (value == 0) return bits;
    bits += mixed_cost<2>(
        m.sign_mixer[c.level],
        {&m.sign_by_trend[c.level * C::trends + c.trend], &m.sign_by_bend[at_level(C::bends, c.bend)]}, value < 0);
    const auto rest = static_cast<std::size_t>(std::abs(value)) - 1;
    for (std::size_t i = 0; i < DisplacementModels::unary && i <= rest; ++i)
        bits += mixed_cost<3>(m.more_mixer[i],
                              {&m.more_by_beside[at_level(C::besides, c.beside)][i],
                               &m.more_by_above[at_level(C::aboves, c.above)][i],
                               &m.more_by_bend[at_level(C::bends, c.bend)][i]},
                              rest > i);
    if (rest >= DisplacementModels::unary)
        bits += 2 * std::log2(static_cast<double>(rest - DisplacementModels::unary) + 1) + 1;
    return bits;
}

// The value that is worth its bits, for a displacement of so many steps.
std::int32_t chosen_value(const DisplacementModels& models, const DisplacementContext& context, double steps,
                          double lambda) {
    const auto nearest = static_cast<std::int32_t>(std::lround(std::clamp(steps, -1e5, 1e5)));
    std::int32_t best = 0;
    double least = steps * steps + lambda * cost_of(models, context, 0);
    for (const auto candidate : {nearest, nearest - (nearest > 0) + (nearest < 0)}) {
        if (candidate == 0) continue;
        const double off = steps - candidate, price = off * off + lambda * cost_of(models, context, candidate);
        if (price < least) least = price, best = candidate;
    }
    return best;
}

// How far along the normals the surface is from some points, in lattice units.
std::vector<double> distances_along(const SurfaceIndex& captured, std::span<const Vector3d> points,
                                    std::span<const Vector3d> normals, const SurfaceLevelsOptions& options) {
    std::vector<double> out(points.size(), 0);
    std::vector<Point3f> queries(points.size()), facing(points.size());
    std::vector<std::uint32_t> guesses(points.size(), OrientedPoints::no_point);
    for (std::size_t i = 0; i < points.size(); ++i) facing[i] = to_floats(normals[i]);
    for (int round = 0; round < 3; ++round) {
        for (std::size_t i = 0; i < points.size(); ++i) queries[i] = to_floats(points[i] + normals[i] * out[i]);
        const auto found = closest_facing(captured, queries, facing,
                                          {.reach = static_cast<float>(options.reach.value), .agreement = 0.3F},
                                          options.threads, guesses);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (found[i].found())
                out[i] += dot(to_vector(found[i].point) - to_vector(queries[i]), normals[i]);
    }
    return out;
}

double squared_misses(const SurfaceIndex& captured, const LevelsWalk& walk, const SurfaceLevelsOptions& options) {
    double sum = 0;
    for (const double d : distances_along(captured, walk.expected, walk.normal, options)) sum += std::min(d * d, 1e4);
    return sum;
}

}  // namespace

EncodedSurfaceLevels encode_surface_levels(const SurfaceIndex& captured, const LatticeMesh& base,
                                           const SurfaceLevelsOptions& options) {
    EncodedSurfaceLevels out;
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    const auto levels = code_levels_header(coder, options.levels);
    LevelsWalk walk(base);
    std::size_t position = 0;
    const auto add_part = [&](std::size_t from, std::size_t moved) {
        out.parts.push_back({walk.positions.size() - from, moved, static_cast<double>(encoder.position() - position)});
        position = encoder.position();
    };
    std::size_t moved = 0;
    {
        std::vector<Vector3d> points;
        for (const auto p : walk.positions) points.push_back(to_vector(p));
        const auto wanted = distances_along(captured, points, vertex_normals(walk.positions, walk.triangles), options);
        code_base_displacements(coder, walk, levels,
                                [&](std::size_t v, const Vector3d&, std::uint32_t step, const DisplacementContext& c) {
                                    const auto value = chosen_value(walk.models, c, wanted[v] * 16 / step, options.lambda);
                                    moved += value != 0;
                                    return value;
                                });
        add_part(0, moved);
    }
    for (std::uint32_t k = 1; k <= levels.levels; ++k) {
        walk.begin_level(levels, k, std::size_t{1} << 24);
        SubdivisionRule best = options.rules.front();
        double least = -1;
        for (const auto& rule : options.rules) {
            if (options.rules.size() == 1) break;
            walk.expect(rule);
            const double misses = squared_misses(captured, walk, options);
            if (least < 0 || misses < least) least = misses, best = rule;
        }
        out.rules.push_back(code_rule(coder, best));
        walk.expect(best);
        const auto wanted = distances_along(captured, walk.expected, walk.normal, options);
        moved = 0;
        code_level_displacements(coder, walk, levels, k,
                                 [&](std::size_t i, std::uint32_t step, const DisplacementContext& c) {
                                     const auto value =
                                         chosen_value(walk.models, c, wanted[i] * 16 / step, options.lambda);
                                     moved += value != 0;
                                     return value;
                                 });
        const auto from = walk.first;
        walk.end_level();
        add_part(from, moved);
    }
    out.run = encoder.finish();
    out.surface = {std::move(walk.positions), std::move(walk.triangles)};
    return out;
}

}  // namespace htvm::internal
