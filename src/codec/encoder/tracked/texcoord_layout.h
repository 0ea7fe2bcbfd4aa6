// Whether the capture's texture atlas is laid out anew. T-frames show the I-frame's texture coordinates, so a new
// layout needs an I-frame: until then the picture of every frame would be looked up in the wrong places.
#pragma once

#include "core/length.h"
#include "htvm/lattice_mesh.hpp"

namespace htvm::internal {

// The share of the tracked mesh's vertices, 0..1, whose texture coordinates no captured vertex within `reach` has, nor
// any that are as close to them as the atlas lets points at that distance be. Vertices of the two meshes need not
// correspond; tracking may slip along the surface by up to the reach, across seams too, and an atlas may map several
// places to the same coordinates. 0 unless both meshes have texture coordinates.
double share_with_other_texcoords(const LatticeMesh& tracked, const LatticeMesh& captured, LatticeUnits reach);

}  // namespace htvm::internal
