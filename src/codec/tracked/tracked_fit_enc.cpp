#include "codec/tracked/tracked_fit_enc.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "surface/nearest_points.h"
#include "surface/surface_search.h"

namespace htvm::internal {
namespace {

// A sample's cube of space, and the squared distance from it to the other surface.
struct SampledDistance {
    std::array<std::int32_t, 3> cube{};
    double squared = 0;
};

// The two farthest of each cube are left out: one sample that found the wrong sheet is no region lost.
double worst_of(std::vector<SampledDistance> samples) {
    constexpr std::ptrdiff_t fewest = 10, left_out = 2;
    std::sort(samples.begin(), samples.end(),
              [](const auto& a, const auto& b) { return a.cube != b.cube ? a.cube < b.cube : a.squared < b.squared; });
    double worst = 0;
    for (auto i = samples.begin(), j = i; i != samples.end(); i = j) {
        j = std::find_if(i, samples.end(), [&](const auto& sample) { return sample.cube != i->cube; });
        if (j - i < fewest) continue;
        const double sum = std::accumulate(i, j - left_out, 0.0,
                                           [](double total, const auto& sample) { return total + sample.squared; });
        worst = std::max(worst, sum / static_cast<double>(j - i - left_out));
    }
    return std::sqrt(worst);
}

// Every so many-th vertex and triangle's middle.
SurfaceSamples samples_of(std::span<const Point3f> points, std::span<const Point3f> normals,
                          std::span<const Triangle> triangles) {
    constexpr std::size_t wanted = 2000;  // of each
    SurfaceSamples out;
    for (std::size_t v = 0, every = 1 + points.size() / wanted; v < points.size(); v += every) {
        out.points.push_back(points[v]);
        out.normals.push_back(normals[v]);
    }
    for (std::size_t t = 0, every = 1 + triangles.size() / wanted; t < triangles.size(); t += every)
        add_middle(out, points, normals, triangles[t]);
    return out;
}

TrackedFit summed_up(const std::vector<Point3f>& points, const std::vector<double>& squared,
                     const TrackedFitOptions& options) {
    if (points.empty()) return {};
    std::vector<SampledDistance> samples(points.size());
    double squares = 0;
    std::size_t strays = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            samples[i].cube[axis] = static_cast<std::int32_t>(std::floor(points[i][axis] / options.region));
        samples[i].squared = squared[i];
        squares += squared[i];
        if (squared[i] > options.stray * options.stray) ++strays;
    }
    const auto count = static_cast<double>(points.size());
    return {std::sqrt(squares / count), static_cast<double>(strays) / count, worst_of(std::move(samples)), {}};
}

// The captured surface is so fine that the triangles round the nearest vertex suffice, and a side is told from the
// other, as of a sleeve, by its normals.
std::vector<double> distances_of_decoded(const SurfaceSamples& decoded, const TargetSurface& captured,
                                         const TrackedFitOptions& options) {
    SurfaceTargetOptions search;
    search.reach = static_cast<float>(options.reach);
    search.agreement = 0;
    search.threads = options.threads;
    const auto found = surface_targets(decoded.points, decoded.normals, captured, search);
    std::vector<double> squared(found.size(), options.reach * options.reach);
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (!found[i].valid) continue;
        squared[i] = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double d = static_cast<double>(found[i].point[axis]) - decoded.points[i][axis];
            squared[i] += d * d;
        }
    }
    return squared;
}

TrackedFit fit_of_captured(const SurfaceSamples& captured, const SurfaceSearch& decoded,
                           const TrackedFitOptions& options) {
    std::vector<double> squared(captured.points.size(), options.reach * options.reach);
    if (!decoded.empty())
        parallel_for(squared.size(), options.threads, 512, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                squared[i] = static_cast<double>(decoded.closest(captured.points[i]).squared_distance);
        });
    return summed_up(captured.points, squared, options);
}

}  // namespace

TrackedFit measure_tracked_fit(const TargetSurface& captured, const LatticeMesh& decoded,
                               std::span<const double> intra_squared, const TrackedFitOptions& options) {
    const auto points = points_of(decoded.positions);
    const auto forth = fit_of_captured(samples_of(captured.positions, captured.normals, captured.triangles),
                                       SurfaceSearch(points, decoded.triangles), options);
    const auto samples =
        samples_of(points, vertex_normals(points, decoded.triangles, options.threads), decoded.triangles);
    auto squared = distances_of_decoded(samples, captured, options);
    std::vector<double> more(squared.size(), 0);
    if (intra_squared.size() == squared.size())
        for (std::size_t i = 0; i < squared.size(); ++i) more[i] = std::max(0.0, squared[i] - intra_squared[i]);
    const auto back = summed_up(samples.points, more, options);
    return {std::max(forth.rms, back.rms), std::max(forth.stray_share, back.stray_share),
            std::max(forth.worst_region, back.worst_region), std::move(squared)};
}

}  // namespace htvm::internal
