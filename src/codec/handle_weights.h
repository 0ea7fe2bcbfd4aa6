// Smooth weights of the handles on a reference mesh. Encoder and decoder both derive them from the decoded reference,
// so that nothing is sent for them: integers only, the same everywhere.
#pragma once

#include <span>

#include "core/handles.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm {

// Each vertex begins with its own handle alone (for bones: its bone; for nodes: the nearest one along the mesh); the
// weights then spread over the mesh's edges, until a border between two handles is about `width` lattice units wide.
// handle_of_vertex: one a vertex. Vertices without triangles keep their handle. The same for any number of threads.
HandleWeights smooth_weights(std::span<const std::uint16_t> handle_of_vertex, std::span<const LatticePoint> positions,
                             std::span<const Triangle> triangles, std::int32_t width, unsigned threads);

}  // namespace htvm
