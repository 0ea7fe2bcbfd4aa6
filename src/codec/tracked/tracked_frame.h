// Tracked frames (design, section 4): the reference mesh's connectivity, moved by the nodes of a deformation graph and
// displaced along its normals; neither connectivity nor mapping nor positions along the surface are sent.
//
// Everything is relative to the group's I-frame: its mesh moved by the nodes' transforms, plus a displacement of each
// vertex along the moved mesh's normal, and its colours plus a change of each. Transforms and fields are predicted from
// the frame before's, or not, as the frame says: one that refers to the I-frame alone may be lost without harm.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/reference/deformation_nodes.h"
#include "codec/stream/frame_payload.h"
#include "codec/tracked/node_motion.h"
#include "codec/tracked/vertex_field.h"
#include "core/geometry.h"
#include "core/lattice.h"
#include "core/thread.h"

namespace htvm::internal {

// What both sides derive from the decoded I-frame, once.
struct TrackedReference {
    LatticeMesh mesh;  // as decoded, its positions smoothed within their cells
    DeformationNodes nodes;
    std::vector<LatticePoint> pivots;    // where the nodes sit
    std::vector<std::uint32_t> parents;  // of each node: its lowest neighbour, where that is lower than itself
    VertexHierarchy hierarchy;
};
// node_spacing: lattice units, > 0. quantiser_step: of the I-frame's positions, lattice units.
// threads: two at most serve.
Result<TrackedReference> make_tracked_reference(const LatticeMesh& mesh, std::int32_t node_spacing,
                                                std::int32_t quantiser_step, Threads threads = {});

// Vertices halfway to the mean of their neighbours, but no farther than half a quantiser step from where they were in
// each coordinate: takes the steps out of a coarsely quantised surface without sending anything.
std::vector<LatticePoint> smoothed_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, std::int32_t quantiser_step);

// What a frame leaves for the next.
struct TrackedState {
    std::vector<QuantisedTransform> transforms;  // one per node
    FieldHistory displacement, colour;
};

// What is not the reference's own: triangles and texture coordinates are.
struct DecodedTrackedFrame {
    std::vector<LatticePoint> positions;
    std::vector<Colour> colours;           // where the reference has them
    std::vector<QuantisedNormal> normals;  // likewise
    TrackedState state;
};

// before: of the frame that the payload refers to; null where that is the I-frame. out: an earlier frame's, whose
// arrays serve again, but not that of `before`; of no use after an error.
Result<void> decode_tracked_frame(const FramePayloadView& payload, const TrackedReference& reference,
                                  const TrackedState* before, Threads threads, DecodedTrackedFrame& out);

// The pieces, which the encoder shares.
// The reference moved by its nodes, one transform per node.
std::vector<LatticePoint> moved_by_nodes(const TrackedReference& reference,
                                         std::span<const QuantisedTransform> transforms, Threads threads);

// Each point moved along its normal by so many lattice units, kept on the lattice.
std::vector<LatticePoint> displaced(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                    std::span<const std::int32_t> displacement);

// Each colour changed by its residual, three components per vertex, kept within 0..255.
std::vector<Colour> recoloured(std::span<const Colour> colours, std::span<const std::int32_t> residuals);

// The normals that a displaced mesh shows, as the codec holds normals.
std::vector<QuantisedNormal> quantised_normals(std::span<const Vector3d> normals);

}  // namespace htvm::internal
