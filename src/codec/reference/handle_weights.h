// Smooth weights of the handles on a reference mesh. Encoder and decoder both derive them from the decoded reference,
// so that nothing is sent for them: integers only, the same everywhere.
#pragma once

#include <span>

#include "core/handles.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "core/thread.h"

namespace htvm::internal {

// Each vertex has a handle of its own (for bones: its bone; for nodes: the nearest one along the mesh). On the border
// between two handles both weigh the same; away from it, along the mesh's edges, the weight of the other one falls in a
// straight line to 0 at half the width, so that the border is `width` lattice units wide. Of more than three others the
// nearest three count. docs/bitstream.md, section 7.4.
// handle_of_vertex: one a position; triangles name positions; width 0..lattice_limit, 0: each vertex its own handle.
// Vertices without triangles keep their handle. The same for any number of threads.
// About 3 ms for 35,000 vertices and 14 bones.
HandleWeights smooth_weights(std::span<const std::uint16_t> handle_of_vertex, std::span<const LatticePoint> positions,
                             std::span<const Triangle> triangles, std::int32_t width, Threads threads);

}  // namespace htvm::internal
