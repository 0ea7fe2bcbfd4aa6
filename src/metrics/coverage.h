// Coverage: how much of a captured surface what is shown explains, and how much of what is shown the capture; and the
// errors over what is covered. What that is, and what it hides, tells counterpart.h.
//
// Places are spread evenly by area over each surface, so that shares are shares of area, and M2 over what is covered is
// that of surface_error.h with samples on the faces alone.
#pragma once

#include <cstdint>
#include <span>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/counterpart.h"
#include "metrics/region_error.h"
#include "metrics/surface_error.h"

namespace htvm {

struct CoverageOptions {
    double within = covered_within_mm;  // mm: a place is covered if the other surface lies within it
    std::uint64_t samples = 50000;      // on each surface
    internal::Threads threads = {};     // the number of threads does not change the result
};

// One surface, as the other one explains it. The places that are neither covered nor absent are displaced.
struct SurfaceCoverage {
    double area = 0, covered = 0, absent = 0;  // mm^2
    SurfaceDistances distances;                // of the places that count
};

// One direction: what `other` has of `own`, at these samples of it.
SurfaceCoverage surface_coverage(const SearchedSurface& own, std::span<const SurfaceSample> samples,
                                 const SearchedSurface& other, const CoverageOptions& options = {});

struct FrameCoverage {
    SurfaceCoverage captured, shown;
    RegionError region;  // the worst one over what is covered (region_error.h), of at least 7 cm^2 that count
};

// Both meshes must be measurable; where one has no triangles, nothing of the other is covered. Errors: bad_input if an
// option is out of range, limit if memory runs out.
Result<FrameCoverage> coverage(const Mesh& captured, const Mesh& shown, const CoverageOptions& options = {});

double covered_share(const SurfaceCoverage& surface);  // 0..1; 1 without an area: nothing is missing
double absent_share(const SurfaceCoverage& surface);   // 0..1
// Whether anything counts in both directions, and the larger of these distances.
bool has_covered_errors(const FrameCoverage& frame);
double covered_m2(const FrameCoverage& frame);

// Several frames. Shares are of all their area; errors as eq. 11 has them, over the frames that have some.
struct SurfaceCoverageSums {
    double area = 0, covered = 0, absent = 0;
    double least_covered = 1;  // the share in the frame that has the least
};
struct CoverageSums {
    std::uint64_t frames = 0;
    SurfaceCoverageSums captured, shown;
    SurfaceErrorSums errors;
};
CoverageSums& operator+=(CoverageSums& sums, const FrameCoverage& frame);
double covered_share(const SurfaceCoverageSums& sums);
double absent_share(const SurfaceCoverageSums& sums);

}  // namespace htvm
