// Tracked frames: the reference mesh with its connectivity, moved by the nodes of a deformation graph and displaced
// along its normals. Neither connectivity, nor mapping, nor positions along the surface are sent.
//
// Everything is relative to the reference, an I- or TP-frame: its mesh is moved by the nodes' transforms, then each
// vertex is displaced along the moved mesh's normal, and its colour is changed. Transforms and fields may be predicted
// from those of the previous frame; each frame says whether they are. A frame that refers to the reference alone does
// not need those before it.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/reference/node_reference.h"
#include "codec/tracked/tracked_payload.h"
#include "core/geometry.h"
#include "core/lattice.h"
#include "core/thread.h"

namespace htvm::internal {

// What a frame leaves for the next one.
struct TrackedState {
    TrackedHead head;
    std::vector<QuantisedTransform> transforms;  // one per node
    FieldHistory displacement, colour;
    Presence presence;  // one per vertex; none in streams that do not tell it
};

// What differs from the reference: everything except triangles and texture coordinates.
struct DecodedTrackedFrame {
    std::vector<LatticePoint> positions;
    std::vector<Colour> colours;           // if the reference has them
    std::vector<QuantisedNormal> normals;  // likewise
    LayerBytes shares;                     // of its payload
    TrackedState state;
};

// payload: one run, as from version 3 of the stream on. before: state of the frame that it refers to; null if that is
// the I-frame. out: may hold an earlier frame, whose arrays are reused, but not the one of `before`; its contents are
// undefined after an error.
Result<void> decode_tracked_frame(std::span<const std::uint8_t> payload, const NodeReference& reference,
                                  const TrackedState* before, Threads threads, DecodedTrackedFrame& out);
// The same of versions 1 and 2, where each layer is a run of its own.
Result<void> decode_tracked_layers(const FramePayloadView& payload, const NodeReference& reference,
                                   const TrackedState* before, Threads threads, DecodedTrackedFrame& out);

// The steps, which the encoder shares. First: the reference moved by its nodes, one transform per node.
std::vector<LatticePoint> moved_by_nodes(const NodeReference& reference, std::span<const QuantisedTransform> transforms,
                                         Threads threads);

// Each point moved along its normal by the given number of lattice units, clamped to the lattice.
std::vector<LatticePoint> displaced(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                    std::span<const std::int32_t> displacement);

// Each colour plus its residual, three components per vertex, clamped to 0..255.
std::vector<Colour> recoloured(std::span<const Colour> colours, std::span<const std::int32_t> residuals);

// The normals of a displaced mesh, in the codec's representation.
std::vector<QuantisedNormal> quantised_normals(std::span<const Vector3d> normals);

}  // namespace htvm::internal
