// Whether a tracked frame still stands for the captured mesh. Encoder side.
#pragma once

#include <span>
#include <vector>

#include "codec/reference/lattice_mesh.h"
#include "surface/target_surface.h"
#include "core/thread.h"

namespace htvm::internal {

// From a few thousand samples each way, the worse direction of the two; lattice units.
struct TrackedFit {
    double rms = 0;               // distance from surface to surface; none counts as more than `reach`
    double stray_share = 0;       // of the samples that are farther than `stray`
    double worst_region = 0;      // the root mean square in the worst cube of space
    std::vector<double> squared;  // distances of the decoded mesh's samples from the captured surface
};

struct TrackedFitOptions {
    double stray = 200;    // lattice units, > 0
    double reach = 400;    // likewise: on the captured surface nothing is looked for farther away
    double region = 1600;  // side of the cubes, likewise; those with few samples are left out
    Threads threads = {};
};

// captured: of the captured mesh. intra_squared: `squared` of the I-frame, whose connectivity `decoded` has; what its
// samples were off there is not held against the frame, since the search does not find every long triangle of a sole,
// nor are those of the I-frame itself, for which it is empty.
TrackedFit measure_tracked_fit(const TargetSurface& captured, const LatticeMesh& decoded,
                               std::span<const double> intra_squared, const TrackedFitOptions& options);

}  // namespace htvm::internal
