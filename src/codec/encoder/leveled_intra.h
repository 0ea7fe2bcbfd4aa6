// An I-frame as a base mesh and the levels of its surface. One step says how fine all of it is: base, triangles and
// displacements are chosen to go with it, in the proportions that measured best (docs/experiments/hierarchy.md).
#pragma once

#include <cstdint>

#include "codec/encoder/surface_levels.h"
#include "codec/format/frame_payload.h"
#include "codec/intra/leveled_frame.h"
#include "core/lattice.h"
#include "core/length.h"
#include "core/thread.h"

namespace htvm::internal {

struct LeveledIntraOptions {
    LatticeUnits step{22};       // of the finest coded level's displacements, > 0
    double base_error = 2.4;     // of the base's simplification, in steps
    double longest_edge = 9.9;   // of the finest coded level's triangles, in steps
    double base_step = 4.4;      // of the base's positions, in steps
    std::uint32_t levels = 2;    // that are coded, 0..most_levels
    std::uint32_t coarser = 12;  // see SurfaceLevels
    double rounded = 0.19;       // SurfaceLevels::rounded, in steps; 0: no level that rounds off
    SubdivisionRule rule{2, 8};
    int base_again = 1;         // see LeveledBaseOptions
    double lambda = 0.107;      // see SurfaceLevelsOptions
    double least_moved = 0.93;  // see SurfaceFitOptions
    int rounds = 4;             // see SurfaceLevelsOptions
    int choices = 3;            // see SurfaceFitOptions
    Threads threads = {};
};

struct LeveledIntra {
    SurfaceLevels settings;
    FramePayload base;         // an I-frame of its own
    LatticeMesh decoded_base;  // as its decoder has it
    EncodedSurfaceLevels levels;
};

// captured: positions and triangles alone are coded.
Result<LeveledIntra> encode_leveled_intra(const LatticeMesh& captured, const LeveledIntraOptions& options);

// Puts it into a payload, but for attributes, and gives the mesh that the decoder will have. referred: the level that
// frames refer to, or the last if there are fewer.
LeveledFrame put_leveled_intra(LeveledIntra coded, std::uint32_t referred, FramePayload& payload);

}  // namespace htvm::internal
