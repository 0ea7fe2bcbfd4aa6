// The error of the worst region of a surface, as large as a hand. Where one region is lost while the rest fits, the
// mean over the whole surface hardly tells.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

struct RegionErrorOptions {
    double radius = 50;               // mm: a region is what lies within a ball around a point of the original
    double spacing = 6;               // mm between samples, about
    std::size_t fewest_samples = 20;  // a region with fewer of them on the original is a speck, and not measured
    std::size_t fewest_decoded = 0;   // with fewer of them on the decoded surface it is not measured from there
    internal::Threads threads = {};   // the number of threads does not change the result
};

struct RegionError {
    double worst_mm = 0;      // RMS distance within the worst region, in the worse direction
    Point3 centre{};          // of this region, mm
    std::size_t regions = 0;  // that were measured
};

// Regions are spread so that every point of the original is within the radius of a centre. The distance is that of
// points of the original within the region to the decoded surface; and of points of the decoded surface to the original
// whose nearest point on the original lies within it. An original without triangles has no regions; a decoded
// mesh without any is infinitely far away. Both meshes must be measurable. Errors: limit, if memory runs out.
Result<RegionError> worst_region(const Mesh& original, const Mesh& decoded, const RegionErrorOptions& options = {});

// As above, but of pairs of places that were found elsewhere, of which only some may count: a sample on one surface and
// what the other has for it. forward: samples of the original; backward: of the decoded surface. The spacing of the
// options is not used; theirs may be another.
struct PlacePair {
    Point3 original{}, decoded{};
};
RegionError worst_region_among(std::span<const PlacePair> forward, std::span<const PlacePair> backward,
                               const RegionErrorOptions& options = {});

// The worst regions of several frames.
struct RegionErrorSummary {
    std::size_t frames = 0;
    double median_mm = 0, p99_mm = 0, largest_mm = 0;  // see percentile.h
};
RegionErrorSummary summarise(std::vector<double> worst_mm);

}  // namespace htvm
