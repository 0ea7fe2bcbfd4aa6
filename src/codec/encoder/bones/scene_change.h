// Detects scene changes, such as another person entering or a jump of the mesh. Encoder only.
#pragma once

#include <span>

#include "core/lattice.h"

namespace htvm::internal {

// True if more than a tenth of either surface is farther than `far` lattice units from the other. Samples a few hundred
// vertices, so it costs next to nothing; both meshes must have a vertex.
bool scene_changed(std::span<const LatticePoint> captured, std::span<const LatticePoint> predicted, double far);

}  // namespace htvm::internal
