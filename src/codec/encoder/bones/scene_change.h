// Detects scene changes, such as another person entering or a jump of the mesh. Encoder only.
#pragma once

#include <span>

#include "core/lattice.h"
#include "core/length.h"

namespace htvm::internal {

// True if more than a tenth of either surface is farther than `far` from the other. Samples a few hundred
// vertices, so it costs next to nothing; both meshes must have a vertex.
bool scene_changed(std::span<const LatticePoint> captured, std::span<const LatticePoint> predicted, LatticeUnits far);

}  // namespace htvm::internal
