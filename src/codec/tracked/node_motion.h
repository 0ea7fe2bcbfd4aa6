// The motion layer of a tracked frame: one quantised rigid transform per node of the deformation graph.
//
// Nodes are coded in ascending order. Each node's transform is predicted from those neighbours that were decoded before
// it and, if the frame refers to the previous one, from its own transform there: as the node was, moved by the mean
// step that these neighbours have made since. The residual of the shift is coded across and along the surface: across
// it a node's motion shows in the shape, along it mostly in nothing, so that the encoder sends little of it there.
//
// Range coded for each node: whether the rotation's largest component is the predicted one (if not, which, raw), the
// other three components, the three of the shift.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/node_reference.h"
#include "codec/reference/transforms.h"
#include "entropy/range_coder.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// How motion is quantised, which the decoder must know.
struct NodeMotionSteps {
    static constexpr int most_rotation = 10, most_shift = 20;
    int rotation_exponent = 4;  // 0..most_rotation: steps of 2^4 / 2^rotation_bits
    int shift_exponent = 3;     // 0..most_shift: steps of 2^3 lattice units
    bool operator==(const NodeMotionSteps&) const = default;
};

// The axes in which shifts are coded, and what predicts them.
enum class NodeMotionSyntax : std::uint8_t {
    axes_of_space,  // version 1 of the stream: predicted by the lowest neighbour alone
    surface,        // across and along the surface, predicted by all lower neighbours
};

// before: as given to the encoder. corrupt_stream if the run ends early.
Result<std::vector<QuantisedTransform>> decode_node_motion(RangeDecoder& decoder, const NodeMotionSteps& steps,
                                                           const NodeGraph& graph,
                                                           std::span<const QuantisedTransform> before,
                                                           NodeMotionSyntax syntax = NodeMotionSyntax::surface);

}  // namespace htvm::internal
