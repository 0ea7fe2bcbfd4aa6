#include "codec/reference/blending.h"

#include <algorithm>

namespace htvm::internal {
namespace {

// A sum of weighted vectors, in 2^-(matrix_bits + weight_bits) lattice units. The weights sum to 2^12, so that sums of
// turned vectors stay below sqrt(3) * 2^25 * 2^36 and those of points that are moved below 2^63.
using WeightedSum = std::array<std::int64_t, 3>;

void add_turned(WeightedSum& sum, std::int64_t weight, const RotationMatrix& m, LatticePoint v) {
    for (std::size_t i = 0; i < 3; ++i) sum[i] += weight * (m[3 * i] * v.x + m[3 * i + 1] * v.y + m[3 * i + 2] * v.z);
}

std::int64_t rounded(std::int64_t sum) {
    constexpr int bits = matrix_bits + weight_bits;
    return (sum + (std::int64_t{1} << (bits - 1))) >> bits;
}

}  // namespace

std::vector<RotationMatrix> rotation_matrices(std::span<const QuantisedTransform> transforms) {
    std::vector<RotationMatrix> out;
    out.reserve(transforms.size());
    for (const auto& t : transforms) out.push_back(rotation_matrix(t.rotation));
    return out;
}

LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift) {
    const LatticePoint turned = rotate(matrix, point - pivot);
    return {within_lattice(std::int64_t{turned.x} + pivot.x + shift.x),
            within_lattice(std::int64_t{turned.y} + pivot.y + shift.y),
            within_lattice(std::int64_t{turned.z} + pivot.z + shift.z)};
}

LatticePoint blended_move(LatticePoint point, const VertexWeights& weights, std::span<const RotationMatrix> rotation,
                          std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> transforms) {
    WeightedSum sum{};
    for (std::size_t i = 0; i < handles_a_vertex && weights.weight[i] > 0; ++i) {
        const auto handle = weights.handle[i];
        const LatticePoint pivot = pivots[handle], to = pivot + transforms[handle].shift;
        add_turned(sum, weights.weight[i], rotation[handle], point - pivot);
        const std::int64_t scale = std::int64_t{weights.weight[i]} << matrix_bits;
        sum[0] += scale * to.x;
        sum[1] += scale * to.y;
        sum[2] += scale * to.z;
    }
    return {within_lattice(rounded(sum[0])), within_lattice(rounded(sum[1])), within_lattice(rounded(sum[2]))};
}

LatticePoint blended_turn(LatticePoint vector, const VertexWeights& weights, std::span<const RotationMatrix> rotation) {
    WeightedSum sum{};
    for (std::size_t i = 0; i < handles_a_vertex && weights.weight[i] > 0; ++i)
        add_turned(sum, weights.weight[i], rotation[weights.handle[i]], vector);
    return {static_cast<std::int32_t>(rounded(sum[0])), static_cast<std::int32_t>(rounded(sum[1])),
            static_cast<std::int32_t>(rounded(sum[2]))};
}

}  // namespace htvm::internal
