#include "metrics/coverage.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "metrics/mesh_measures.h"

namespace htvm {
namespace {

// What a region needs of area that counts: that of region_error.h's fewest samples.
constexpr double least_region_area = 20 * 36;  // mm^2

struct OneWay {
    SurfaceCoverage sums;
    std::vector<SurfaceSample> samples;
    std::vector<Counterpart> found;
    std::size_t fewest() const {  // samples on the least area of a region
        const double each = sums.area / static_cast<double>(std::max<std::size_t>(samples.size(), 1));
        return each > 0 ? static_cast<std::size_t>(std::ceil(least_region_area / each)) : 1;
    }
};

SurfaceDistances distances_of(const std::vector<Counterpart>& found) {
    SurfaceDistances out;
    double squared = 0;
    for (const auto& at : found) {
        if (!at.counts) continue;
        ++out.samples;
        out.mean += at.distance;
        squared += at.distance * at.distance;
        out.largest = std::max(out.largest, at.distance);
    }
    if (out.samples == 0) return out;
    out.mean /= static_cast<double>(out.samples);
    out.rms = std::sqrt(squared / static_cast<double>(out.samples));
    return out;
}

SurfaceCoverage summarise(const Mesh& own, const std::vector<Counterpart>& found) {
    SurfaceCoverage out;
    out.area = surface_area(own.positions, own.triangles);
    const double each = out.area / static_cast<double>(std::max<std::size_t>(found.size(), 1));
    const auto area_of = [&](Presence presence) {
        return each * static_cast<double>(std::ranges::count(found, presence, &Counterpart::presence));
    };
    out.covered = area_of(Presence::covered);
    out.absent = area_of(Presence::absent);
    out.distances = distances_of(found);
    return out;
}

OneWay measure(const SearchedSurface& own, const SearchedSurface& other, const CoverageOptions& options) {
    OneWay out;
    out.samples = so_many_samples_on(own.mesh(), options.samples);
    out.found = counterparts(out.samples, own, other, options.within, options.threads);
    out.sums = summarise(own.mesh(), out.found);
    return out;
}

RegionError region_of(const OneWay& captured, const OneWay& shown, const CoverageOptions& options) {
    std::vector<PlacePair> forward, backward;
    for (std::size_t i = 0; i < captured.samples.size(); ++i)
        if (captured.found[i].counts) forward.push_back({captured.samples[i].place, captured.found[i].nearest});
    for (std::size_t i = 0; i < shown.samples.size(); ++i)
        if (shown.found[i].counts) backward.push_back({shown.found[i].nearest, shown.samples[i].place});
    RegionErrorOptions regions;
    regions.fewest_samples = captured.fewest();
    regions.fewest_decoded = shown.fewest();
    regions.threads = options.threads;
    return worst_region_among(forward, backward, regions);
}

double share(double part, double area, double of_nothing) { return area > 0 ? part / area : of_nothing; }

void add(SurfaceCoverageSums& sums, const SurfaceCoverage& frame) {
    sums.area += frame.area;
    sums.covered += frame.covered;
    sums.absent += frame.absent;
    sums.least_covered = std::min(sums.least_covered, covered_share(frame));
}

}  // namespace

SurfaceCoverage surface_coverage(const SearchedSurface& own, std::span<const SurfaceSample> samples,
                                 const SearchedSurface& other, const CoverageOptions& options) {
    return summarise(own.mesh(), counterparts(samples, own, other, options.within, options.threads));
}

Result<FrameCoverage> coverage(const Mesh& captured, const Mesh& shown, const CoverageOptions& options) {
    if (!(options.within > 0) || !std::isfinite(options.within))
        return fail(ErrorKind::bad_input, "The distance that counts as covered must be more than 0 mm.");
    const auto first = SearchedSurface::build(captured, options.threads);
    if (!first) return tl::unexpected(first.error());
    const auto second = SearchedSurface::build(shown, options.threads);
    if (!second) return tl::unexpected(second.error());
    const OneWay forward = measure(*first, *second, options), backward = measure(*second, *first, options);
    return FrameCoverage{forward.sums, backward.sums, region_of(forward, backward, options)};
}

double covered_share(const SurfaceCoverage& surface) { return share(surface.covered, surface.area, 1); }
double absent_share(const SurfaceCoverage& surface) { return share(surface.absent, surface.area, 0); }
double covered_share(const SurfaceCoverageSums& sums) { return share(sums.covered, sums.area, 1); }
double absent_share(const SurfaceCoverageSums& sums) { return share(sums.absent, sums.area, 0); }

bool has_covered_errors(const FrameCoverage& frame) {
    return frame.captured.distances.samples > 0 && frame.shown.distances.samples > 0;
}

double covered_m2(const FrameCoverage& frame) {
    return std::max(frame.captured.distances.rms, frame.shown.distances.rms);
}

CoverageSums& operator+=(CoverageSums& sums, const FrameCoverage& frame) {
    ++sums.frames;
    add(sums.captured, frame.captured);
    add(sums.shown, frame.shown);
    if (has_covered_errors(frame)) sums.errors += SurfaceError{frame.captured.distances, frame.shown.distances};
    return sums;
}

}  // namespace htvm
