#include "codec/reference/rigid_transform.h"

#include <cmath>

namespace htvm::internal {

RotationMatrix rotation_matrix(const QuantisedRotation& rotation) {
    std::array<std::int64_t, 4> q{};
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        q[i] = i == rotation.largest ? std::int64_t{1} << rotation_bits : rotation.others[other++];
    const std::int64_t w = q[0], x = q[1], y = q[2], z = q[3];
    const std::int64_t norm = w * w + x * x + y * y + z * z;
    const std::array<std::int64_t, 9> scaled = {
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z),           2 * (x * z + w * y),
        2 * (x * y + w * z),           w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y),           2 * (y * z + w * x),           w * w - x * x - y * y + z * z};
    RotationMatrix matrix{};
    for (std::size_t i = 0; i < 9; ++i) matrix[i] = divide_rounded(scaled[i] * (std::int64_t{1} << matrix_bits), norm);
    return matrix;
}

LatticePoint rotate(const RotationMatrix& m, LatticePoint v) {
    constexpr std::int64_t half = std::int64_t{1} << (matrix_bits - 1);
    auto row = [&](std::size_t i) {
        return static_cast<std::int32_t>((m[i] * v.x + m[i + 1] * v.y + m[i + 2] * v.z + half) >> matrix_bits);
    };
    return {row(0), row(3), row(6)};
}

QuantisedRotation quantise_rotation(const std::array<double, 4>& quaternion) {
    QuantisedRotation out;
    for (std::uint8_t i = 1; i < 4; ++i)
        if (std::abs(quaternion[i]) > std::abs(quaternion[out.largest])) out.largest = i;
    const double scale = static_cast<double>(1 << rotation_bits) / quaternion[out.largest];
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        if (i != out.largest) out.others[other++] = static_cast<std::int16_t>(std::lround(quaternion[i] * scale));
    return out;
}

}  // namespace htvm::internal
