// The nodes of a deformation graph: handles for captures without a skeleton, sampled on the reference mesh (Sumner,
// Schmid, Pauly: Embedded deformation for shape manipulation, 2007). Encoder and decoder both derive them from the
// decoded reference, so nothing is sent for them; integers only, so that every machine finds the same nodes.
//
// Distances run along the mesh: over its edges, and over links between vertices that are close but not joined by a
// triangle, as where a mesh is cut along the seams of its texture.
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
    std::int32_t spacing = 80 * 16;    // lattice units, > 0: the largest distance along the mesh from a vertex to its
                                       // node
    std::int32_t link_reach = 8 * 16;  // lattice units, >= 0: pieces within this distance of each other are linked
    std::size_t most_nodes = most_deformation_nodes;  // 1 .. most_deformation_nodes; if there would be more, the
                                                      // spacing is widened
};

// Two nodes that pull on each other; first < second.
struct NodePair {
    std::uint16_t first = 0, second = 0;
    auto operator<=>(const NodePair&) const = default;
};

struct DeformationNodes {
    std::vector<std::uint32_t> vertex;            // the vertex at which each node sits, in the order in which nodes
                                                  // were chosen
    std::vector<std::uint16_t> handle_of_vertex;  // the nearest node along the mesh; of equally near ones, the lower
    HandleWeights weights;                        // of the nearest nodes along the mesh; a node's weight falls to zero
                                                  // where the next nearest one takes over
    std::uint64_t searched = 0;                   // vertices visited by the searches from the nodes, counting repeats:
                                                  // a measure of the work done, at most 16 per vertex and attempt
    std::vector<NodePair> neighbours;             // ascending, without repeats: nodes whose regions touch, and pairs
                                                  // that tie separate groups to the nearest ones, so that all nodes are
                                                  // connected
};

// Chooses nodes in the order of the vertices: each vertex that no node reaches within `spacing` becomes one, so that no
// two nodes are nearer than that to each other. Accepts any triangles (indices < positions.size()); a mesh without
// vertices has no nodes. If this takes more than most_nodes, the spacing is widened. If even that does not help
// (thousands of pieces far apart), vertices that no node reaches are assigned to the node nearest in space.
DeformationNodes choose_deformation_nodes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                          const DeformationNodeOptions& options);

}  // namespace htvm::internal
