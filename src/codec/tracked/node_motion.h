// The motion layer of a tracked frame: one quantised rigid transform per node of the deformation graph.
//
// Each node's transform is predicted from that of its parent, a neighbour that was decoded before it, and, if the frame
// refers to the previous one, from its own transform there. The residual is coded in steps of a power of two.
//
// Layer: a byte of flags (bit 0: refers to the previous frame), a byte for the rotations' step (its exponent), one for
// the shifts'; then, range coded, for each node: whether the rotation's largest component is the predicted one (if not,
// which, raw), the other three components, the shift.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/transforms.h"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::uint32_t no_parent = 0xFFFFFFFF;

struct NodeMotionOptions {
    int rotation_exponent = 4;  // 0..10: steps of 2^4 / 2^rotation_bits
    int shift_exponent = 3;     // 0..20: steps of 2^3 lattice units
};

struct EncodedNodeMotion {
    std::vector<std::uint8_t> bytes;
    std::vector<QuantisedTransform> transforms;  // the transforms that the decoder will have
};

// wanted: one per node. parents: one per node, less than its own number, or no_parent. pivots: one per node. before:
// the transforms of the previous frame, or empty.
EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, std::span<const std::uint32_t> parents,
                                     std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> before,
                                     const NodeMotionOptions& options);

// before: one per node; needed if the layer refers to it. corrupt_stream if the bytes end early or contain invalid
// values.
Result<std::vector<QuantisedTransform>> decode_node_motion(std::span<const std::uint8_t> bytes,
                                                           std::span<const std::uint32_t> parents,
                                                           std::span<const LatticePoint> pivots,
                                                           std::span<const QuantisedTransform> before);

// The prediction of a node's transform, the same on both sides. parent: the parent's number, its transform in this
// frame and in the previous one (null if there is none).
QuantisedTransform predict_node_transform(std::size_t node, std::uint32_t parent,
                                          std::span<const QuantisedTransform> decoded,
                                          std::span<const LatticePoint> pivots,
                                          std::span<const QuantisedTransform> before);

}  // namespace htvm::internal
