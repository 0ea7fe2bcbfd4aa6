// Positions that are no numbers: some programs write NaN for vertices that nothing shows.
#pragma once

#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// Leaves out vertices whose position is not finite, and the triangles that use them, from the lists of triangles' parts
// too, and tells of it. Fails (bad_input, naming the first such vertex) if more than a tenth of the triangles would go,
// or all vertices of a mesh without triangles.
Result<void> leave_out_not_finite(Mesh& mesh, std::vector<std::uint16_t>& part_of_triangle, MeshFindings* findings);

}  // namespace htvm
