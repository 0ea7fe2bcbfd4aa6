// Small holes of a captured surface, closed. A depth camera drops a pixel here and there, in other places in each
// frame; in a mesh that later frames refer to such holes would stay. Encoder only.
#pragma once

#include "core/length.h"
#include "htvm/lattice_mesh.hpp"

namespace htvm::internal {

struct HoleFillingOptions {
    LatticeUnits longest{960};    // rim of a hole that is closed
    std::size_t most_sides = 40;  // of it
    double flat = 0.15;  // how far a rim may leave its plane, in shares of its length: beyond that it is an edge
                         // behind which something else lies
};

// Closes each hole by triangles around a vertex in its middle, with the mean of its rim's colour. Borders that run
// around a part, not around a hole, stay. The mesh must be welded, without normals and texture coordinates. Gives how
// many holes were closed.
std::size_t fill_small_holes(LatticeMesh& mesh, const HoleFillingOptions& options);

}  // namespace htvm::internal
