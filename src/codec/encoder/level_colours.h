// Chooses and codes the colours of a surface's detail.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/level_colours.h"
#include "core/thread.h"
#include "surface/surface_index.h"

namespace htvm::internal {

struct LevelColourOptions {
    std::int32_t step = 6;  // of colours, 1..255
    double lambda = 0.2;    // squared steps, of all components together, that a bit must spare
    double reach = 480;     // how far from a vertex the captured surface may lie, lattice units
    Threads threads = {};
};

// The layer; sets detail.colours to what the decoder will have. mesh: the reference, as decoded. captured: with an
// index of its surface. coded: how many of the detail's levels have colours of their own.
std::vector<std::uint8_t> encode_level_colours(const LatticeMesh& mesh, const LatticeMesh& captured,
                                               const SurfaceIndex& surface, std::size_t coded,
                                               const LevelColourOptions& options, SurfaceDetail& detail);

}  // namespace htvm::internal
