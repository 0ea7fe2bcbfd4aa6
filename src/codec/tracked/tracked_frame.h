// Tracked frames: the reference mesh with its connectivity, moved by the nodes of a deformation graph and displaced
// along its normals. Neither connectivity, nor mapping, nor positions along the surface are sent.
//
// Everything is relative to the group's I-frame: its mesh is moved by the nodes' transforms, then each vertex is
// displaced along the moved mesh's normal, and its colour is changed. Transforms and fields may be predicted from those
// of the previous frame; each frame says whether they are. A frame that refers to the I-frame alone may be lost without
// harm to others.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/reference/deformation_nodes.h"
#include "codec/tracked/tracked_payload.h"
#include "core/geometry.h"
#include "core/lattice.h"
#include "core/thread.h"

namespace htvm::internal {

// What both sides derive once from the decoded I-frame.
struct TrackedReference {
    LatticeMesh mesh;  // as decoded, with positions averaged if they were not smoothed
    DeformationNodes nodes;
    NodeGraph graph;
    VertexHierarchy hierarchy;
    CapturedCounts captured;  // what the I-frame was captured with; make_tracked_reference() does not know it
};
// What is derived first, for a frame that does a part of the next one's work.
struct TrackedAhead {
    VerticesAround around;
    VertexHierarchy hierarchy;
};
// node_spacing: lattice units, > 0. step: of the mesh's positions, lattice units, where they are still to be averaged,
// as in streams before shown_smoothed_version; else 1. threads: uses two at most. kept: of a patched mesh, what it
// takes over of the nodes before. ahead: of this mesh, where it is known already; then step must be 1.
Result<TrackedReference> make_tracked_reference(const LatticeMesh& mesh, std::int32_t node_spacing, std::int32_t step,
                                                Threads threads = {}, const KeptNodes& kept = {},
                                                std::optional<TrackedAhead> ahead = {});

// How a mesh's positions are quantised.
struct QuantiserCells {
    std::int32_t step = 1;      // lattice units
    std::uint32_t settled = 0;  // the first so many vertices are not
    bool at_seams = false;      // vertices at the same place move as one, so that a texture's seams stay closed
};

// Takes off an eighth of what bends the surface at a vertex more than at its neighbours, but moves no coordinate
// farther than half a quantiser step, nor what is settled. This removes most of the steps of a coarsely quantised
// surface at no cost in bits, and leaves round ones as they are.
std::vector<LatticePoint> smoothed_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, const QuantiserCells& cells);

// Moves each vertex halfway to the mean of its neighbours, but in each coordinate no farther than half a quantiser
// step: so are the references of streams before shown_smoothed_version. Where edges are long, round limbs shrink.
std::vector<LatticePoint> averaged_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, std::int32_t step);

// What a frame leaves for the next one.
struct TrackedState {
    TrackedHead head;
    std::vector<QuantisedTransform> transforms;  // one per node
    FieldHistory displacement, colour;
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
Result<void> decode_tracked_frame(std::span<const std::uint8_t> payload, const TrackedReference& reference,
                                  const TrackedState* before, Threads threads, DecodedTrackedFrame& out);
// The same of versions 1 and 2, where each layer is a run of its own.
Result<void> decode_tracked_layers(const FramePayloadView& payload, const TrackedReference& reference,
                                   const TrackedState* before, Threads threads, DecodedTrackedFrame& out);

// The steps, which the encoder shares. First: the reference moved by its nodes, one transform per node.
std::vector<LatticePoint> moved_by_nodes(const TrackedReference& reference,
                                         std::span<const QuantisedTransform> transforms, Threads threads);

// Each point moved along its normal by the given number of lattice units, clamped to the lattice.
std::vector<LatticePoint> displaced(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                    std::span<const std::int32_t> displacement);

// Each colour plus its residual, three components per vertex, clamped to 0..255.
std::vector<Colour> recoloured(std::span<const Colour> colours, std::span<const std::int32_t> residuals);

// The normals of a displaced mesh, in the codec's representation.
std::vector<QuantisedNormal> quantised_normals(std::span<const Vector3d> normals);

}  // namespace htvm::internal
