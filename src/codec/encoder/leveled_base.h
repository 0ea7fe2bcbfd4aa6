// The base mesh under a surface's levels: a simplified captured surface, finer where its subdivision would leave much
// of the captured surface aside.
#pragma once

#include "codec/reference/subdivision.h"
#include "core/lattice.h"
#include "core/length.h"
#include "core/thread.h"
#include "surface/surface_index.h"

namespace htvm::internal {

struct LeveledBaseOptions {
    LatticeUnits surface_error{56};  // of the simplification, > 0
    // How often it is made again, finer where vertices of the captured surface are farther off than so many times their
    // RMS distance.
    int again = 1;
    double outlier = 3;
    SubdivisionDepth depth;  // of the levels to come that are coded
    SubdivisionRule rule;
    LatticeUnits step{29};  // of the finest level's displacements
    Threads threads = {};
};

// captured: without two vertices at a place. sampled: the same, evenly_sampled().
LatticeMesh leveled_base(const LatticeMesh& captured, const SurfaceIndex& sampled, const LeveledBaseOptions& options);

}  // namespace htvm::internal
