// Whether a tracked frame still stands for the captured mesh. Encoder side.
#pragma once

#include "codec/lattice_mesh.h"
#include "geometry/target_surface.h"

namespace htvm {

// From a few thousand samples each way, the worse direction of the two; lattice units.
struct TrackedFit {
    double rms = 0;           // distance from surface to surface; none counts as more than `reach`
    double stray_share = 0;   // of the samples that are farther than `stray`
    double worst_region = 0;  // the root mean square in the worst cube of space
};

struct TrackedFitOptions {
    double stray = 200;    // lattice units, > 0
    double reach = 400;    // likewise: on the captured surface nothing is looked for farther away
    double region = 1600;  // side of the cubes, likewise; those with few samples are left out
    unsigned threads = 1;
};

// captured: of the captured mesh.
TrackedFit measure_tracked_fit(const TargetSurface& captured, const LatticeMesh& decoded,
                               const TrackedFitOptions& options);

}  // namespace htvm
