// How much there is to see where on a captured surface: where the images had detail, pictures get more texels.
#pragma once

#include <span>
#include <vector>

#include "core/lattice.h"
#include "surface/surface_index.h"

namespace htvm::internal {

// At each position how much the captured colours change around it, in levels a lattice unit; empty if the capture has
// no colours. captured: indexed by direction.
std::vector<float> captured_detail(std::span<const LatticePoint> positions, const SurfaceIndex& captured);

}  // namespace htvm::internal
