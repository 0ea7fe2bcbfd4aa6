// Vertices that no triangle names: those of a decoded frame that are not there (FrameView::presence).
#pragma once

#include "htvm/mesh.hpp"

namespace htvm {

// Takes them out. The others keep their order. Every triangle's indices must be below the number of vertices.
void drop_loose_vertices(Mesh& mesh);

}  // namespace htvm
