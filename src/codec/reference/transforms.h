// Quantised rigid transforms: how one moves lattice points, how several are blended by the weights of a vertex, and the
// layers that carry them (paper, section IV-B). Integers only, the same everywhere.
//
// Transforms layer: for each transform whether it does nothing, else the largest quaternion component (2 bits), the
// other three and the shift as adaptive signed numbers, one model for each of rotation and shift.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "core/vertex_weights.h"
#include "htvm/result.hpp"

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

std::vector<RotationMatrix> rotation_matrices(std::span<const QuantisedTransform> transforms);

// One point moved by one transform; the result is kept within the lattice.
LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift);

// The weighted mean of where its handles move the point, rounded once and kept within the lattice. rotation, pivots and
// transforms: one per handle.
LatticePoint blended_move(LatticePoint point, const VertexWeights& weights, std::span<const RotationMatrix> rotation,
                          std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> transforms);

// A vector turned by its handles, blended likewise.
LatticePoint blended_turn(LatticePoint vector, const VertexWeights& weights, std::span<const RotationMatrix> rotation);

std::vector<std::uint8_t> encode_transforms(std::span<const QuantisedTransform> transforms);
Result<std::vector<QuantisedTransform>> decode_transforms(std::span<const std::uint8_t> bytes, std::size_t bones);

// S_I: the joints of the I-frame's pose, on the lattice, and the orientation T_I of each bone.
struct CodedPose {
    std::vector<LatticePoint> joints;
    std::vector<QuantisedRotation> orientations;
};
std::vector<std::uint8_t> encode_pose(const CodedPose& pose);
Result<CodedPose> decode_pose(std::span<const std::uint8_t> bytes, std::size_t joints, std::size_t bones);

}  // namespace htvm::internal
