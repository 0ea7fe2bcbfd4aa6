// A multi-resolution order of a mesh's vertices, for coding smooth fields on a mesh that both sides know.
//
// Vertices are joined into pairs, pairs into pairs of pairs, and so on until one node is left. Pairs are formed along
// the mesh's edges, preferring short ones and nodes with few vertices; where the mesh does not offer enough pairs
// (pieces, isolated vertices, hubs), by nearness in space. Each node stands for the mean of a field over the vertices
// below it. The means of the nodes around it predict the difference between the two nodes that it joins. A field is
// thus coded as one mean, and a difference for each pair: Haar's transform on a tree (like RAHT: de Queiroz, Chou
// 2016), with coefficients predicted from the coarser level.
//
// Both sides derive the hierarchy from the decoded reference, with integers and doubles computed by + - x / sqrt, so
// every machine gets the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::uint32_t no_node = std::numeric_limits<std::uint32_t>::max();
inline constexpr int slope_bits = 12;
inline constexpr int share_bits = 30;
inline constexpr std::size_t hierarchy_row_limit = 32;  // most neighbours kept per node
inline constexpr int split_scale_bits = 14;

// A level of nodes, each joining one or two nodes of the next finer level. All arrays are indexed by node, except
// `neighbours` and `slopes`.
struct HierarchyLevel {
    std::vector<std::uint32_t> first, second;  // the nodes joined; second = no_node if there is only one
    std::vector<std::uint32_t> vertices;       // number of vertices below, at least 1
    // For a pair with a and b vertices: first = mean + difference * second_share, second = first - difference.
    std::vector<std::uint32_t> second_share;     // b / (a + b) in 1/2^share_bits
    std::vector<std::uint16_t> split_scale;      // sqrt(1/a + 1/b) in 1/2^split_scale_bits: the difference with the
                                                 // same squared error as one vertex that is off by 1; 0 without a
                                                 // second
    std::vector<std::uint32_t> first_neighbour;  // row p of the next two: first_neighbour[p] .. first_neighbour[p + 1]
    std::vector<std::uint32_t> neighbours;       // distinct nodes of this level joined to p by an edge of the mesh
    // The predicted difference is the sum of slope * (mean of the neighbour - own mean), by the gradient that fits best
    // in the least-squares sense. In 1/2^slope_bits, |.| <= 2^15. Zero without a second.
    std::vector<std::int32_t> slopes;
    bool mutual = true;  // every node is a neighbour of its neighbours; not where rows are at their limit

    std::size_t size() const { return first.size(); }
};

struct VertexHierarchy {
    std::size_t vertex_count = 0;
    std::vector<HierarchyLevel> levels;  // the first level joins vertices, the last has a single node; empty for < 2
                                         // vertices
};

// Accepts any triangles: non-manifold, duplicate, degenerate, none. Every level has at most three quarters of the nodes
// of the one below, plus one. Apart from sorting, time is linear in vertices plus triangles. Errors: bad_input if a
// triangle names a vertex that does not exist or a position is off the lattice; limit above 2^28 vertices or triangles.
// around: of these triangles, where it is known; or null.
Result<VertexHierarchy> build_vertex_hierarchy(std::span<const LatticePoint> positions,
                                               std::span<const Triangle> triangles,
                                               const VerticesAround* around = nullptr);

}  // namespace htvm::internal
