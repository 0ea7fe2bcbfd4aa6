// Sets of the numbers 0 .. count - 1 that grow together (union-find with path halving). The name of a set is its lowest
// number, in whatever order sets were joined.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace htvm::internal {

class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
    // The set that a number is in.
    std::uint32_t of(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    // False if both were in one set already.
    bool join(std::uint32_t a, std::uint32_t b) {
        a = of(a), b = of(b);
        if (a == b) return false;
        parent_[std::max(a, b)] = std::min(a, b);
        return true;
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace htvm::internal
