// What frames refer to: a decoded I-frame, or one that patched it, numbered, and what both sides derive from it.
// Encoder and decoder build it in the same way. The mesh never changes afterwards; what follows from bones or nodes may
// be derived later, since the decoder does not know which kind of frame comes next.
#pragma once

#include <cstdint>
#include <optional>

#include "codec/format/sequence.h"
#include "codec/reference/film_projection.h"
#include "codec/reference/node_reference.h"
#include "codec/reference/skinning.h"
#include "codec/reference/surface_detail.h"
#include "codec/reference/textured_surface.h"
#include "codec/reference/transforms.h"
#include "core/thread.h"

namespace htvm::internal {

struct Reference {
    std::uint32_t number = 0;                  // of the frame
    std::int32_t step = 1;                     // of its positions, in lattice units; 1 if they were smoothed
    CapturedCounts captured;                   // what its frame was captured with
    TexturedSurface textured;                  // where the stream has charts: of the mesh
    std::optional<FilmProjection> projection;  // where its texture is a film: of this frame
    ReferenceMesh skinned;   // the mesh and its pose; what depends on bones is filled in only if it was derived
    bool has_bones = false;  // whether it was derived
    std::optional<NodeReference> by_nodes;  // what depends on the nodes, if it was derived
    KeptNodes kept;                         // of a patched mesh: what it takes over of the nodes before
    std::optional<NodesAhead> ahead;        // of what depends on the nodes, if only this was derived so far
    Presence presence;                      // of the mesh's vertices, in streams that tell it
    SurfaceDetail detail;                   // of the mesh, with which it is shown
    const LatticeMesh& mesh() const { return skinned.mesh; }
};

// What to derive, depending on the frames that will refer to it: bones for EP- and P-frames, nodes for T-frames.
struct Derived {
    bool bones = true;
    bool nodes = false;  // no effect if the header has no node spacing
};

// What the frame's packet tells, beside its mesh and pose.
struct ReferenceFacts {
    std::uint32_t number = 0;
    std::int32_t step = 1;
    CapturedCounts captured;
    KeptNodes kept = {};  // of a TP-frame
    TexturedSurface textured = {};
    Presence presence = {};
    SurfaceDetail detail = {};
    std::optional<FilmProjection> projection = {};
};

// Smooths an I-frame's mesh within its quantiser cells, as it is shown in streams with nodes from
// shown_smoothed_version on, unless it is settled: of a mesh that was smoothed before. Elsewhere does nothing. step: of
// its positions. Returns the step of the reference that the mesh becomes.
std::int32_t smooth_as_shown(LatticeMesh& mesh, std::int32_t step, bool settled, const SequenceHeader& header);

// mesh: as decoded. Errors: those of make_node_reference().
Result<Reference> make_reference(const SequenceHeader& header, ReferenceFacts facts, LatticeMesh mesh, CodedPose pose,
                                 Derived derived, Threads threads);

// Derive later what was not derived at once. No effect if it exists already.
void derive_bones(Reference& reference, const SequenceHeader& header, Threads threads);
// Derives a part of what depends on the nodes, so that the frame that needs them has less to do. No effect in streams
// without nodes, and in those whose references are still to be averaged.
void derive_hierarchy(Reference& reference, const SequenceHeader& header);
// Needs a header with a node spacing.
Result<void> derive_nodes(Reference& reference, const SequenceHeader& header, Threads threads);

}  // namespace htvm::internal
