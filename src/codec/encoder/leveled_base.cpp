#include "codec/encoder/leveled_base.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "codec/encoder/surface_levels_fit.h"
#include "surface/simplification.h"

namespace htvm::internal {
namespace {

constexpr std::size_t most_vertices = std::size_t{1} << 24;

LatticeMesh simplified(const LatticeMesh& captured, const LeveledBaseOptions& options, std::span<const float> finer) {
    SimplificationOptions simplification;
    simplification.surface_error = options.surface_error.value;
    simplification.finer = finer;
    simplification.threads = options.threads;
    return simplified_mesh(captured, simplification);
}

// How far each captured vertex is from the base's subdivided surface where it fits best, in lattice units.
std::vector<double> left_aside(const LatticeMesh& captured, const SurfaceIndex& sampled, const LatticeMesh& base,
                               const LeveledBaseOptions& options) {
    constexpr int rounds = 2, choices = 2;  // more bring nothing here
    SurfaceLevels levels;
    const auto& depth = levels.depth = options.depth;
    levels.step = static_cast<std::uint32_t>(std::max(1.0, options.step.value * (1 << displacement_bits)));
    levels.rules.fill(options.rule);
    std::vector<double> out;
    const auto subdivision = subdivide(base, depth, most_vertices);
    if (!subdivision) return out;
    SurfaceFitOptions fit_options;
    fit_options.choices = choices;
    fit_options.threads = options.threads;
    SurfaceFit fit(sampled, base, *subdivision, levels, depth.levels, fit_options);
    fit.improve(0, rounds);
    const SurfaceIndex shown(points_of(fit.surface()),
                             subdivision->empty() ? base.triangles : subdivision->back().triangles);
    if (shown.empty()) return out;
    for (const auto& p : captured.positions)
        out.push_back(std::sqrt(static_cast<double>(shown.closest(point_of(p)).squared_distance)));
    return out;
}

// How many times finer the base is to be at each vertex, from how far off it is.
std::vector<float> finer_where_left(const LatticeMesh& captured, std::span<const double> distances, double outlier) {
    constexpr double most = 3;
    constexpr int rings = 2;  // around what is left
    double squares = 0;
    for (const double d : distances) squares += d * d;
    const double usual = outlier * std::sqrt(squares / static_cast<double>(std::max<std::size_t>(distances.size(), 1)));
    std::vector<float> out;
    for (const double d : distances)
        out.push_back(usual > 0 ? static_cast<float>(std::clamp(d / usual, 1.0, most)) : 1);
    const auto around = vertices_around(captured.positions.size(), captured.triangles);
    for (int ring = 0; ring < rings; ++ring) {
        auto wider = out;
        for (std::size_t v = 0; v < out.size(); ++v)
            for (const auto other : around.of(v)) wider[v] = std::max(wider[v], out[other]);
        out = std::move(wider);
    }
    return out;
}

}  // namespace

LatticeMesh leveled_base(const LatticeMesh& captured, const SurfaceIndex& sampled, const LeveledBaseOptions& options) {
    auto base = simplified(captured, options, {});
    std::vector<float> finer(captured.positions.size(), 1);
    for (int i = 0; i < options.again; ++i) {
        const auto distances = left_aside(captured, sampled, base, options);
        if (distances.empty()) break;
        const auto more = finer_where_left(captured, distances, options.outlier);
        for (std::size_t v = 0; v < finer.size(); ++v) finer[v] *= more[v];
        base = simplified(captured, options, finer);
    }
    return base;
}

}  // namespace htvm::internal
