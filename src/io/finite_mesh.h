// Positions that are not finite: organised point clouds, depth cameras and solvers write NaN for what they do not know.
#pragma once

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// Leaves out the vertices at such positions and the triangles that use them, and says so in findings, whose
// part_of_triangle keeps step. Fails (bad_input), naming a vertex (counted from 0), if they are more than a tenth of
// the vertices that triangles use, or all vertices.
Result<void> leave_out_not_finite(Mesh& mesh, MeshFindings& findings);

}  // namespace htvm
