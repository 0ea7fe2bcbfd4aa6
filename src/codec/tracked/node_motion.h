// The motion layer of a tracked frame: one quantised rigid transform a node of the deformation graph.
//
// Each node's transform is predicted from the one of its parent, a neighbour that was decoded before it, and, where the
// frame refers to the one before, from its own there. What remains is coded in steps of a power of two.
//
// Layer: a byte of flags (bit 0: refers to the frame before), a byte for the rotations' step (its exponent), one for
// the shifts', then range coded: per node whether the rotation's largest component is the predicted one's (else which
// it is, raw), the other three components, the shift.
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
    std::vector<QuantisedTransform> transforms;  // as the decoder has them
};

// wanted: one per node. parents: one per node, < its own number or no_parent. pivots: one per node. before: the frame
// before's, or empty.
EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, std::span<const std::uint32_t> parents,
                                     std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> before,
                                     const NodeMotionOptions& options);

// before: one per node; needed where the layer says so. corrupt_stream where the bytes end early or say what cannot be.
Result<std::vector<QuantisedTransform>> decode_node_motion(std::span<const std::uint8_t> bytes,
                                                           std::span<const std::uint32_t> parents,
                                                           std::span<const LatticePoint> pivots,
                                                           std::span<const QuantisedTransform> before);

// What a node's transform is predicted to be; both sides. parent: the parent's number, its transform in this frame and
// in the one before (null where there is none).
QuantisedTransform predict_node_transform(std::size_t node, std::uint32_t parent,
                                          std::span<const QuantisedTransform> decoded,
                                          std::span<const LatticePoint> pivots,
                                          std::span<const QuantisedTransform> before);

}  // namespace htvm::internal
