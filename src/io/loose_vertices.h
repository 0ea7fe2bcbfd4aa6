// Vertices that no triangle names: those of a decoded frame that are not there (FrameView::presence).
#pragma once

#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm {

// Takes them out. The others keep their order; returned is where each of them was. Every triangle's indices must be
// below the number of vertices.
std::vector<std::uint32_t> drop_loose_vertices(Mesh& mesh);

}  // namespace htvm
