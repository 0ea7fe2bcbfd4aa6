// An I-frame as a base mesh and the levels of its surface. One step says how fine all of it is: base, triangles and
// displacements are chosen to go with it, in the proportions that measured best (docs/experiments/hierarchy.md).
#pragma once

#include <cstdint>

#include "codec/encoder/surface_levels.h"
#include "codec/format/frame_payload.h"
#include "core/lattice.h"
#include "core/length.h"
#include "core/thread.h"

namespace htvm::internal {

struct LeveledIntraOptions {
    LatticeUnits step{29};       // of the finest level's displacements, > 0
    double base_error = 1.8;     // of the base's simplification, in steps
    double longest_edge = 3.7;   // of the finest level's triangles, in steps
    double base_step = 3.3;      // of the base's positions, in steps
    std::uint32_t levels = 3;    // 0..most_levels
    std::uint32_t coarser = 12;  // see SurfaceLevels
    SubdivisionRule rule{2, 8};
    int base_again = 1;        // see LeveledBaseOptions
    double lambda = 0.06;      // see SurfaceLevelsOptions
    double least_moved = 0.7;  // see SurfaceFitOptions
    Threads threads = {};
};

struct LeveledIntra {
    FramePayload base;         // an I-frame of its own
    LatticeMesh decoded_base;  // as its decoder has it
    EncodedSurfaceLevels levels;
};

// captured: positions and triangles alone are coded.
Result<LeveledIntra> encode_leveled_intra(const LatticeMesh& captured, const LeveledIntraOptions& options);

}  // namespace htvm::internal
