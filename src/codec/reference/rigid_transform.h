// A quantised rigid transform and how it moves lattice points: integers only, the same everywhere.
#pragma once

#include <array>
#include <cstdint>

#include "core/lattice.h"

namespace htvm::internal {

// A rotation as a quaternion whose largest component is 2^rotation_bits and positive; the others follow in order
// (w, x, y, z without it), each within +-2^rotation_bits. Of angle quanta about 2^-13 rad: 0.06 mm half a metre away.
inline constexpr int rotation_bits = 13;
struct QuantisedRotation {
    std::uint8_t largest = 0;  // 0 w, 1 x, 2 y, 3 z
    std::array<std::int16_t, 3> others{};
    bool operator==(const QuantisedRotation&) const = default;
};

// v' = R (v - pivot) + pivot + shift. The pivot is not sent: both sides take it from the reference mesh.
struct QuantisedTransform {
    QuantisedRotation rotation;
    LatticePoint shift;
    bool operator==(const QuantisedTransform&) const = default;
};

// R as integers over 2^matrix_bits.
inline constexpr int matrix_bits = 24;
using RotationMatrix = std::array<std::int64_t, 9>;
RotationMatrix rotation_matrix(const QuantisedRotation& rotation);

// R v, each component rounded to the nearest integer (halves towards +infinity).
LatticePoint rotate(const RotationMatrix& matrix, LatticePoint v);

// The quantised rotation nearest to a quaternion w, x, y, z of any length but zero.
QuantisedRotation quantise_rotation(const std::array<double, 4>& quaternion);

}  // namespace htvm::internal
