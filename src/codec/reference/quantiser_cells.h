// Smoothing of decoded meshes within the cells in which their positions were quantised: the steps of a coarsely
// quantised surface go, at no cost in bits.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// How a mesh's positions are quantised.
struct QuantiserCells {
    std::int32_t step = 1;      // lattice units
    std::uint32_t settled = 0;  // the first so many vertices are not
    bool at_seams = false;      // vertices at the same place move as one, so that a texture's seams stay closed
};

// Takes off an eighth of what bends the surface at a vertex more than at its neighbours, but moves no coordinate
// farther than half a quantiser step, nor what is settled. This removes most of the steps of a coarsely quantised
// surface at no cost in bits, and leaves round ones as they are.
std::vector<LatticePoint> smoothed_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, const QuantiserCells& cells);

// Moves each vertex halfway to the mean of its neighbours, but in each coordinate no farther than half a quantiser
// step: so are the references of streams before shown_smoothed_version. Where edges are long, round limbs shrink.
std::vector<LatticePoint> averaged_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, std::int32_t step);

}  // namespace htvm::internal
