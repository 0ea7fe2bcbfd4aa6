// Sparse symmetric systems of blocks of 6 x 6, a row and column of them for each handle that turns and shifts, and
// their solution by conjugate gradients. Encoder only.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

namespace htvm::internal {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// The pairs of handles that have a block in the matrix, row < column; block i belongs to place[i].
struct BlockPattern {
    std::size_t handles = 0;
    std::vector<std::pair<std::uint16_t, std::uint16_t>> place;  // ascending
    std::vector<std::uint32_t> first;                            // where each row begins, then the end of the last:
                                                                 // handles + 1 entries
    // The block of a pair; row < column, and the pair must be in the pattern.
    std::uint32_t find(std::uint16_t row, std::uint16_t column) const;
};
// pairs may be in any order and direction, and repeated; pairs of a handle with itself are ignored.
BlockPattern make_pattern(std::size_t handles, std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs);

// Symmetric: the blocks below the diagonal are the transposes of those above.
struct BlockSystem {
    std::vector<Matrix6> diagonal, above;  // one per handle; one per place of the pattern
    std::vector<Vector6> right;
    explicit BlockSystem(const BlockPattern& pattern);
};

// Solves system * x = right by conjugate gradients, preconditioned with the diagonal blocks. Stops after `iterations`
// steps, or once the residual has shrunk by the factor `tolerance`. The system must be positive definite.
std::vector<Vector6> solve(const BlockPattern& pattern, const BlockSystem& system, int iterations, double tolerance);

}  // namespace htvm::internal
