// A patch: a part of a tracked mesh is taken out, and a piece with connectivity of its own put in its place. Where
// tracking is lost in one region, this takes the bits of that region alone instead of an I-frame's. The patched mesh
// is the reference of the frames that follow.
//
// What goes is coded over the reference's vertex hierarchy, from coarse to fine: whether a node goes as a whole, stays
// as a whole, or is mixed. Triangles of which a vertex goes, go with it. What comes is intra coding that goes on from
// what stays: the piece's connectivity is coded as triangle fans, in which each vertex is either new or one of the open
// border's, named by its place there. Only the new ones have positions and colours in the stream, predicted also from
// the border's, which both sides know.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/reference/vertex_hierarchy.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct SurfacePatch {
    std::vector<bool> removed;  // one per vertex of the tracked mesh
    // The piece. Indices below removed.size() name vertices of the tracked mesh that stay and have both triangles that
    // stay and triangles that go; others, minus that size, name new vertices.
    std::vector<Triangle> triangles;
    std::vector<LatticePoint> positions;  // of the new vertices
    std::vector<Colour> colours;          // of the new vertices, if the tracked mesh has them
};

// The mesh that is patched: as the T-frame part of the frame leaves it.
struct TrackedSurface {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;  // one per vertex, or none
};

struct PatchedSurface {
    LatticeMesh mesh;  // vertices that stay come first, in their order, then the new ones; triangles likewise
    std::vector<std::uint32_t> stays;  // the vertices of the tracked mesh that stay, ascending
};

// The steps of an I-frame.
struct PatchSteps {
    std::int32_t geometry = 32;  // of new positions, in lattice units, >= 1
    std::int32_t colour = 6;     // of new colours, in levels, 1..255
};

// Sets the layers `removed`, `border`, `fans`, `geometry` and `colour` and the header's counts and steps, and returns
// the mesh that the decoder will have. hierarchy: of the tracked mesh. Errors: bad_input if the piece names a vertex
// that is neither new nor on the open border, or if sizes do not fit.
Result<PatchedSurface> encode_patch(const TrackedSurface& tracked, const VertexHierarchy& hierarchy,
                                    const SurfacePatch& patch, const PatchSteps& steps, FramePayload& payload);

// Errors: corrupt_stream.
Result<PatchedSurface> decode_patch(const FramePayloadView& payload, const TrackedSurface& tracked,
                                    const VertexHierarchy& hierarchy);

// Makes the mesh what is shown and referred to: what is new is smoothed within its quantiser cells, and normals, if the
// reference has them, follow from the surface. step: of the new positions, as coded.
void smooth_what_is_new(PatchedSurface& patched, std::int32_t step, bool with_normals);

// The vertices that stay and have both triangles that stay and triangles that go, each once: along the edges at which
// the mesh opens, so that neighbours on the border have places next to each other.
std::vector<std::uint32_t> open_border(std::span<const Triangle> triangles, const std::vector<bool>& removed);

}  // namespace htvm::internal
