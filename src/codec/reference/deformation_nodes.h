// Nodes of a deformation graph: handles for captures without a skeleton, sampled on the reference mesh (Sumner, Schmid,
// Pauly: Embedded deformation for shape manipulation, 2007). Encoder and decoder both derive them from the decoded
// reference, so that nothing is sent for them: integers only, the same everywhere.
//
// Distances run along the mesh: over its edges, and over links between vertices that lie together though no triangle
// joins them, as where a mesh is cut along the seams of its texture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "core/vertex_weights.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

inline constexpr std::size_t most_deformation_nodes = 1024;

struct DeformationNodeOptions {
    std::int32_t spacing = 80 * 16;    // lattice units, > 0: every vertex has a node at most this far along the mesh
    std::int32_t link_reach = 8 * 16;  // lattice units, >= 0: pieces that come this near to each other are linked
    std::size_t most_nodes = most_deformation_nodes;  // 1 .. most_deformation_nodes; fewer fit by a wider spacing
};

// Two nodes that pull on each other, first < second.
struct NodePair {
    std::uint16_t first = 0, second = 0;
    auto operator<=>(const NodePair&) const = default;
};

struct DeformationNodes {
    std::vector<std::uint32_t> vertex;            // the vertex at which each node sits; in the order of choice
    std::vector<std::uint16_t> handle_of_vertex;  // the nearest node along the mesh, of equally near ones the lower
    HandleWeights weights;                        // of the nearest nodes along the mesh, falling to nothing where the
                                                  // next nearest one takes over
    std::uint64_t searched = 0;                   // vertices that the searches from the nodes came to, some many times:
                                                  // what choosing took, at most 16 per vertex and attempt
    std::vector<NodePair> neighbours;             // ascending, each once: nodes whose regions touch, and what ties
                                                  // groups apart from each other to the nearest: all are connected
};

// Chooses nodes in the order of the vertices: each vertex that no node reaches within `spacing` becomes one, so that no
// two are nearer than that to each other. Any triangles will do (their indices < positions.size()); a mesh without
// vertices has no nodes. With more than most_nodes at this spacing a wider one is taken; where not even that helps
// (thousands of pieces far apart), vertices that no node reaches take the node nearest in space.
DeformationNodes choose_deformation_nodes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                          const DeformationNodeOptions& options);

}  // namespace htvm::internal
