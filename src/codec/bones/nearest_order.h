// The exact order of the vertices nearest to a vertex (the paper's section IV-D), the same on every machine.
//
// A balanced k-d tree of tight bounding boxes, stored without pointers. A query starts at the vertex's own leaf and
// works upwards. Ties are pruned too (each node knows its lowest index), so many equal points take no longer than
// distinct ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"

namespace htvm::internal {

class NearestOrder {
public:
    // Points must be on the lattice (|coordinate| <= lattice_limit), at most 2^32 - 2 of them. O(n log n).
    explicit NearestOrder(std::span<const LatticePoint> points);

    // Writes the indices of the points nearest to points[of], excluding itself, by ascending squared distance, ties by
    // ascending index: as many as there are and as fit in `nearest` (at most 64). Returns how many. Thread-safe.
    std::size_t find(std::uint32_t of, std::span<std::uint32_t> nearest) const;

private:
    struct Entry {
        LatticePoint point;
        std::uint32_t index = 0;
    };
    struct Node {
        LatticePoint low, high;  // the bounding box of the points below it
        std::uint32_t lowest_index = 0;
    };
    struct Search;

    std::size_t leaf_begin(std::size_t leaf) const { return entries_.size() * leaf >> depth_; }
    void split(std::size_t begin_leaf, std::size_t end_leaf);
    void bound_nodes();
    void scan_leaf(std::size_t leaf, Search& search) const;
    void descend(std::size_t node, Search& search) const;

    std::vector<Entry> entries_;          // leaf after leaf
    std::vector<std::uint32_t> leaf_of_;  // by point index
    std::vector<Node> nodes_;             // node 1 is the root; node n has the children 2n and 2n + 1
    int depth_ = 0;                       // 2^depth leaves
};

}  // namespace htvm::internal
