// A multi-resolution order of a mesh's vertices, for coding smooth fields on a mesh that both sides know.
//
// Vertices are joined in pairs, the pairs again in pairs, and so on until one node is left: along the mesh's edges,
// near ones first, few vertices first; where the mesh offers too few pairs (pieces, isolated vertices, hubs), by
// nearness in space. Each node stands for the mean of a field over the vertices below it, and knows what the means
// round it say about the difference between the two nodes that it joins. So a field is one mean and a difference for
// each pair: Haar's transform on a tree (as RAHT: de Queiroz, Chou 2016), whose coefficients are predicted from the
// coarser level.
//
// Both sides derive it from the decoded reference: doubles made of + - x / sqrt, and integers, the same everywhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::uint32_t no_node = std::numeric_limits<std::uint32_t>::max();
inline constexpr int slope_bits = 12;
inline constexpr int share_bits = 30;
inline constexpr std::size_t hierarchy_row_limit = 32;  // neighbours kept per node
inline constexpr int split_scale_bits = 14;

// Nodes that join one or two nodes of the next finer level. Arrays by node, but for `neighbours` and `slopes`.
struct HierarchyLevel {
    std::vector<std::uint32_t> first, second;  // the nodes joined; second = no_node where there is only one
    std::vector<std::uint32_t> vertices;       // how many there are below, at least 1
    // Of a pair with a and b vertices: first = mean + difference * second_share, second = first - difference.
    std::vector<std::uint32_t> second_share;     // b / (a + b) in 1/2^share_bits
    std::vector<std::uint16_t> split_scale;      // sqrt(1/a + 1/b) in 1/2^split_scale_bits: the difference that has the
                                                 // squared error of one vertex that is off by 1; 0 without a second
    std::vector<std::uint32_t> first_neighbour;  // row p of the next two: first_neighbour[p] .. first_neighbour[p + 1]
    std::vector<std::uint32_t> neighbours;       // distinct nodes of this level joined to p by an edge of the mesh
    // The predicted difference is the sum of slope * (mean of the neighbour - own mean), in 1/2^slope_bits, |.| <=
    // 2^15: the gradient that fits best, by least squares. Zero without a second.
    std::vector<std::int32_t> slopes;

    std::size_t size() const { return first.size(); }
};

struct VertexHierarchy {
    std::size_t vertex_count = 0;
    std::vector<HierarchyLevel> levels;  // the first joins vertices, the last has one node; none for < 2 vertices

    std::size_t node_count() const {  // of all levels together
        std::size_t count = 0;
        for (const auto& level : levels) count += level.size();
        return count;
    }
};

// Any triangles will do: non-manifold, duplicate, degenerate, none. Every level has at most three quarters of the nodes
// of the one below, plus one. Time is proportional to vertices plus triangles, but for sorting.
// Errors: bad_input where a triangle names a vertex that is not there or a position is off the lattice; limit above
// 2^28 vertices or triangles.
Result<VertexHierarchy> build_vertex_hierarchy(std::span<const LatticePoint> positions,
                                               std::span<const Triangle> triangles);

}  // namespace htvm::internal
