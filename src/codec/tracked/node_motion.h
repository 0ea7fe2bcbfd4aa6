// The motion layer of a tracked frame: one quantised rigid transform per node of the deformation graph.
//
// Nodes are coded in ascending order. Each node's transform is predicted from those neighbours that were decoded before
// it and, if the frame refers to the previous one, from its own transform there: as the node was, moved by the mean
// step that these neighbours have made since. The residual of the shift is coded across and along the surface: across
// it a node's motion shows in the shape, along it mostly in nothing, so the encoder leaves small residuals out there.
// This keeps the registration's jitter along the surface, which would otherwise be most of the layer, out of the
// stream.
//
// Layer: a byte of flags (bit 0: refers to the previous frame; bit 1: predicted and coded as described above, without
// it as in version 1 of the stream, by one neighbour and in space), a byte for the rotations' step (its exponent), one
// for the shifts'; then, range coded, for each node: whether the rotation's largest component is the predicted one (if
// not, which, raw), the other three components, the three of the shift.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/transforms.h"
#include "core/geometry.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// What both sides know of the nodes, one entry per node.
struct NodeGraph {
    std::vector<LatticePoint> pivots;               // where the nodes sit
    std::vector<std::vector<std::uint32_t>> lower;  // neighbours with a lower number, ascending
    std::vector<Vector3d> normals;                  // of the surface at the pivots, unit length or zero
};

struct NodeMotionOptions {
    int rotation_exponent = 4;  // 0..10: steps of 2^4 / 2^rotation_bits
    int shift_exponent = 3;     // 0..20: steps of 2^3 lattice units
    double still_along = 0;     // lattice units: a residual along the surface below this is not coded
};

struct EncodedNodeMotion {
    std::vector<std::uint8_t> bytes;
    std::vector<QuantisedTransform> transforms;  // the transforms that the decoder will have
};

// wanted: one per node. before: the transforms of the previous frame, or empty.
EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, const NodeGraph& graph,
                                     std::span<const QuantisedTransform> before, const NodeMotionOptions& options);

// before: one per node; needed if the layer refers to it. corrupt_stream if the bytes end early or contain invalid
// values.
Result<std::vector<QuantisedTransform>> decode_node_motion(std::span<const std::uint8_t> bytes, const NodeGraph& graph,
                                                           std::span<const QuantisedTransform> before);

}  // namespace htvm::internal
