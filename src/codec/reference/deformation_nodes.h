// The nodes of a deformation graph: handles for captures without a skeleton, sampled on the reference mesh (Sumner,
// Schmid, Pauly: Embedded deformation for shape manipulation, 2007). Encoder and decoder both derive them from the
// decoded reference, so nothing is sent for them; integers only, so that every machine finds the same nodes.
//
// Distances run along the mesh: over its edges, and over links between vertices that are close but not joined by a
// triangle, as where a mesh is cut along the seams of its texture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry.h"
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

// A node, and how far it is from a vertex along the mesh; nearest first.
struct NearNode {
    std::uint32_t distance = 0;  // lattice units
    std::uint16_t node = 0;
    auto operator<=>(const NearNode&) const = default;
};
// The few nodes nearest to a vertex, nearest first: those that move it, and one more, at which their influence ends.
inline constexpr std::size_t near_nodes = handles_per_vertex + 1;
struct NearNodes {
    std::array<NearNode, near_nodes> near{};
    std::uint8_t count = 0;
    bool operator==(const NearNodes&) const = default;
};

struct DeformationNodes {
    std::vector<std::uint32_t> vertex;            // the vertex at which each node sits, in the order in which nodes
                                                  // were chosen
    std::vector<std::uint16_t> handle_of_vertex;  // the nearest node along the mesh; of equally near ones, the lower
    HandleWeights weights;                        // of the nearest nodes along the mesh; a node's weight falls to zero
                                                  // where the next nearest one takes over
    std::vector<NearNodes> near;                  // of each vertex
    std::int32_t spacing = 0;                     // at which the nodes were found; 0 if it does not cover the mesh
    std::uint64_t searched = 0;                   // vertices visited by the searches from the nodes, counting repeats:
                                                  // a measure of the work done, at most 16 per vertex and attempt
    std::vector<NodePair> neighbours;             // ascending, without repeats: nodes whose regions touch, and pairs
                                                  // that tie separate groups to the nearest ones, so that all nodes are
                                                  // connected
};

// What a patched mesh takes over from the nodes of the mesh before: those whose vertices stay, in their order, and how
// far they were from the vertices that stay. So a patch changes nothing away from it, and what it costs to derive the
// nodes depends on its size.
struct KeptNodes {
    std::int32_t spacing = 0;           // at which the nodes were found
    std::vector<std::uint32_t> vertex;  // of each node, as numbered in the patched mesh; none: nothing is taken over
    std::vector<NearNodes> near;        // of the patched mesh's first vertices, those that stay
};
// stays: the vertices that stay, ascending.
KeptNodes keep_nodes(const DeformationNodes& nodes, std::span<const std::uint32_t> stays);

// Chooses nodes in the order of the vertices: each vertex that no node reaches within `spacing` becomes one, so that no
// two nodes are nearer than that to each other. Accepts any triangles (indices < positions.size()); a mesh without
// vertices has no nodes. If this takes more than most_nodes, the spacing is widened. If even that does not help
// (thousands of pieces far apart), vertices that no node reaches are assigned to the node nearest in space.
//
// kept: goes on from these nodes at their spacing. Only vertices with fewer than near_nodes near ones look for more,
// and only those that no kept node reaches become nodes. If this takes more than most_nodes, all are chosen anew.
// around: of these triangles, where it is known; or null.
DeformationNodes choose_deformation_nodes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                          const DeformationNodeOptions& options, const KeptNodes& kept = {},
                                          const VerticesAround* around = nullptr);

}  // namespace htvm::internal
