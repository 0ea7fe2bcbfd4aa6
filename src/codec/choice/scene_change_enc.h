// Scene changes: another person enters, the mesh jumps. Encoder side.
#pragma once

#include <span>

#include "core/lattice.h"

namespace htvm::internal {

// True where more than a tenth of either surface is farther than `far` lattice units from the other. Samples a few
// hundred vertices, so that asking costs next to nothing; both must have a vertex.
bool scene_changed(std::span<const LatticePoint> captured, std::span<const LatticePoint> predicted, double far);

}  // namespace htvm::internal
