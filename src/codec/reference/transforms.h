// Quantised rigid transforms: how one moves lattice points, how several are blended by a vertex's weights, and the
// layers that carry them (paper, section IV-B). Integers only, so every machine gets the same result.
//
// Transforms layer: for each transform whether it is the identity; if not, which quaternion component is the largest (2
// bits), the other three and the shift as adaptive signed numbers, with one model for rotations and one for shifts.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "core/vertex_weights.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// A rotation as a quaternion whose largest component is 2^rotation_bits and positive. The others follow in the order
// (w, x, y, z without it), each within +-2^rotation_bits. A quantum is an angle of about 2^-13 rad: 0.06 mm at a
// distance of half a metre.
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

// R as integers in units of 2^-matrix_bits.
inline constexpr int matrix_bits = 24;
using RotationMatrix = std::array<std::int64_t, 9>;
RotationMatrix rotation_matrix(const QuantisedRotation& rotation);

// R v, each component rounded to the nearest integer (halves towards +infinity).
LatticePoint rotate(const RotationMatrix& matrix, LatticePoint v);

// The quantised rotation nearest to a quaternion w, x, y, z of any length except zero.
QuantisedRotation quantise_rotation(const std::array<double, 4>& quaternion);

std::vector<RotationMatrix> rotation_matrices(std::span<const QuantisedTransform> transforms);

// One point moved by one transform; the result is clamped to the lattice.
LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift);

// A transform as it moves any point: R point + offset, both in units of 2^-matrix_bits. The matrix is in doubles, which
// hold it and what is blended of it exactly, and ten for nine: vectors of two are faster than whole numbers of 64 bits.
struct PointMove {
    std::array<double, 10> rotation;  // the last is 0
    std::array<std::int64_t, 3> offset;
};
// pivots: one per transform.
std::vector<PointMove> point_moves(std::span<const QuantisedTransform> transforms,
                                   std::span<const LatticePoint> pivots);

// The weighted mean of the places where a point's handles move it, rounded once and clamped to the lattice. moves: one
// per handle.
LatticePoint blended_move(LatticePoint point, const VertexWeights& weights, std::span<const PointMove> moves);

// A vector turned by its handles, blended in the same way.
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
