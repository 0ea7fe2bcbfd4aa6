// The linear system of a Gauss-Newton step on handle motions: six unknowns a handle (a turn about the handle's own
// moved position, then a shift), blocks where two handles share a vertex or pull on each other. Encoder side.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace htvm::internal {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Which pairs of handles have a block, row < column; block i stands for place[i].
struct BlockPattern {
    std::size_t handles = 0;
    std::vector<std::pair<std::uint16_t, std::uint16_t>> place;  // ascending
    std::vector<std::uint32_t> first;                            // of each row, handles + 1
    // The block of a pair that is in the pattern, row < column.
    std::uint32_t find(std::uint16_t row, std::uint16_t column) const;
};
// pairs in any order, either way round, repeated or not; equal ends are passed over.
BlockPattern make_pattern(std::size_t handles, std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs);

// Symmetric: the blocks below the diagonal are the transposed ones above.
struct BlockSystem {
    std::vector<Matrix6> diagonal, above;  // one a handle; one a place
    std::vector<Vector6> right;
    explicit BlockSystem(const BlockPattern& pattern);
    void clear();
    BlockSystem& operator+=(const BlockSystem& other);
};

// Solves system * x = right by conjugate gradients, preconditioned by the diagonal blocks; stops after `iterations` or
// when the residual has shrunk by `tolerance`. The system must be positive definite.
std::vector<Vector6> solve(const BlockPattern& pattern, const BlockSystem& system, int iterations, double tolerance);

}  // namespace htvm::internal
