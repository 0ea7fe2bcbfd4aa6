#include "surface/block_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace htvm::internal {

std::uint32_t BlockPattern::find(std::uint16_t row, std::uint16_t column) const {
    const auto begin = place.begin() + first[row], end = place.begin() + first[row + std::size_t{1}];
    return static_cast<std::uint32_t>(std::lower_bound(begin, end, std::pair{row, column}) - place.begin());
}

BlockPattern make_pattern(std::size_t handles, std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs) {
    BlockPattern pattern;
    pattern.handles = handles;
    // The columns of each row; most pairs are named many times.
    std::vector<std::vector<std::uint16_t>> rows(handles);
    for (const auto& p : pairs) {
        if (p.first == p.second) continue;
        auto& row = rows[std::min(p.first, p.second)];
        const auto column = std::max(p.first, p.second);
        if (std::find(row.begin(), row.end(), column) == row.end()) row.push_back(column);
    }
    pattern.first.assign(handles + 1, 0);
    for (std::size_t h = 0; h < handles; ++h) {
        std::sort(rows[h].begin(), rows[h].end());
        for (const auto column : rows[h]) pattern.place.emplace_back(static_cast<std::uint16_t>(h), column);
        pattern.first[h + 1] = static_cast<std::uint32_t>(pattern.place.size());
    }
    return pattern;
}

BlockSystem::BlockSystem(const BlockPattern& pattern)
    : diagonal(pattern.handles, Matrix6::Zero()),
      above(pattern.place.size(), Matrix6::Zero()),
      right(pattern.handles, Vector6::Zero()) {}

namespace {

double product(const std::vector<Vector6>& a, const std::vector<Vector6>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

void multiply(const BlockPattern& pattern, const BlockSystem& system, const std::vector<Vector6>& x,
              std::vector<Vector6>& out) {
    for (std::size_t h = 0; h < x.size(); ++h) out[h].noalias() = system.diagonal[h] * x[h];
    for (std::size_t i = 0; i < pattern.place.size(); ++i) {
        const auto [row, column] = pattern.place[i];
        out[row].noalias() += system.above[i] * x[column];
        out[column].noalias() += system.above[i].transpose() * x[row];
    }
}

}  // namespace

std::vector<Vector6> solve(const BlockPattern& pattern, const BlockSystem& system, int iterations, double tolerance) {
    const std::size_t handles = pattern.handles;
    std::vector<Matrix6> inverse(handles);
    for (std::size_t h = 0; h < handles; ++h) inverse[h] = system.diagonal[h].llt().solve(Matrix6::Identity());
    std::vector<Vector6> x(handles, Vector6::Zero()), residual = system.right, z(handles), direction(handles),
                                                      image(handles);
    for (std::size_t h = 0; h < handles; ++h) direction[h] = z[h] = inverse[h] * residual[h];
    double height = product(residual, z);
    const double goal = height * tolerance * tolerance;
    for (int i = 0; i < iterations && height > goal && height > 0; ++i) {
        multiply(pattern, system, direction, image);
        const double curvature = product(direction, image);
        if (!(curvature > 0)) break;
        const double step = height / curvature;
        for (std::size_t h = 0; h < handles; ++h) {
            x[h] += step * direction[h];
            residual[h] -= step * image[h];
            z[h].noalias() = inverse[h] * residual[h];
        }
        const double next = product(residual, z);
        const double turn = next / height;
        height = next;
        for (std::size_t h = 0; h < handles; ++h) direction[h] = z[h] + turn * direction[h];
    }
    return x;
}

}  // namespace htvm::internal
