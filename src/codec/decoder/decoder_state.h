// What a decoder keeps from frame to frame, and how a decoded mesh is shown.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/bones/codebook.h"
#include "codec/format/decoder_limits.h"
#include "codec/format/sequence.h"
#include "codec/reference/reference.h"
#include "codec/tracked/frame_group.h"
#include "codec/tracked/tracked_frame.h"
#include "core/thread.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {

// A decoded mesh on the lattice. What a frame shares with its reference is not copied: the spans point into the
// reference.
struct LatticeMeshView {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;
    std::span<const QuantisedNormal> normals;
    std::span<const QuantisedTexcoord> texcoords;
    const TexturedSurface* textured = nullptr;   // how it is shown where the stream has charts
    std::span<const std::uint8_t> presence{};    // one per vertex, or none: all are there
    const SurfaceDetail* detail = nullptr;       // that it is shown with
    const FilmProjection* projection = nullptr;  // that gives its texture coordinates; null: none does
};
inline LatticeMeshView view_of(const LatticeMesh& mesh, const TexturedSurface* textured = nullptr) {
    return {mesh.positions, mesh.triangles, mesh.colours, mesh.normals, mesh.texcoords, textured};
}

// The mesh of an I- or TP-frame, which is the reference of what follows.
inline LatticeMeshView view_of(const Reference& reference) {
    auto out = view_of(reference.mesh(), &reference.textured);
    out.presence = reference.presence;
    out.detail = &reference.detail;
    if (reference.projection) out.projection = &*reference.projection;
    return out;
}

// The frame decoded last, in millimetres. Arrays are reused from frame to frame; triangles and colours stay where they
// were decoded.
struct ShownFrame {
    std::uint32_t topology = 0;            // 0: there is none
    std::uint32_t reference_topology = 0;  // of the mesh of which it may be a part
    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;
    std::vector<Vector2f> texcoords;
    std::uint32_t texcoords_topology = 0;      // reference_topology of the frame they belong to; 0: of that frame alone
    std::vector<QuantisedTexcoord> projected;  // the same before they were floats, where they are a projection's
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;
    std::vector<Colour> own_colours;      // where vertices are repeated
    std::vector<Triangle> own_triangles;  // where some are not there
    Presence presence;                    // one per vertex; none: all are there
    LatticeMesh fine;                     // what is shown of a mesh with detail; its triangles are the detail's
    Presence fine_presence;
    TexturedSurface coarser;             // with fewer levels of detail than there are: how that is shown
    std::uint32_t coarser_topology = 0;  // reference_topology that it is of, with
    std::size_t coarser_levels = 0;      // so many levels
    LatticeMesh own;                     // the mesh of a frame that shares nothing with its reference
    Pose pose;
};

// What of the reference was shown last, where that was not all of it, and the number given to it.
struct ShownPresence {
    std::uint32_t reference_topology = 0, topology = 0;
    Presence presence;
};

// State left by the EP- and P-frames since the I-frame.
struct DecodedBones {
    std::vector<QuantisedTransform> transforms;  // of the last such frame, one per bone; empty if there was none
    std::optional<NumberedCodebook> geometry_codebook, colour_codebook;
};

// The group of T-frames that the last packets were of (tracked/frame_group.h). Its last frame is DecodedNodes::last.
struct DecodedGroup {
    std::uint32_t first = 0;                     // number of its first frame
    std::size_t length = 0;                      // 0: there is none
    bool of_reference = false;                   // whether it refers to the reference alone, else to `earlier`
    DecodedTrackedFrame earlier;                 // the last frame of the group before
    std::vector<DecodedTrackedFrame> between;    // frames 1 to length - 1; keeps its arrays for the next group
    std::array<bool, most_in_group> is_there{};  // which of these were decoded
};

// State left by the T-frames since the I-frame: the last one that later ones may refer to, and arrays for the next. A
// frame that nothing refers to stays in those.
struct DecodedNodes {
    std::optional<std::uint32_t> frame;  // number that names the last one that may be referred to, if any
    DecodedTrackedFrame last, next;
    DecodedGroup group;
    const DecodedTrackedFrame* newest = nullptr;  // the one shown last; null if there is none
    LayerBytes shares;                            // of its packet's payload
    Pose pose;                                    // of the newest
};

// An I-frame that nothing refers to: kept only to be shown again where the frame behind it is missing.
struct UnreferredIntra {
    std::uint32_t frame = 0, topology = 0;
    LatticeMesh mesh;
    SurfaceDetail detail;
    TexturedSurface textured;
    std::optional<FilmProjection> projection;
    Pose pose;
};

struct DecoderState {
    DecoderOptions options;
    ThreadPool pool;
    Threads threads = {};  // those of the pool
    std::optional<SequenceHeader> header;
    std::vector<std::uint8_t> header_payload;
    std::optional<SequenceInfo> info;
    std::uint32_t sequences = 0;                 // begun so far
    std::optional<std::uint32_t> highest_frame;  // met in this one, decoded or not
    std::optional<Reference> reference;
    std::uint32_t reference_topology = 0;
    std::uint32_t topologies = 0;  // how many numbers were given out
    ShownPresence shown_presence;
    bool prepares = false;  // whether the caller calls Decoder::prepare()
    DecodedBones bones;
    DecodedNodes nodes;
    std::optional<UnreferredIntra> unreferred;  // where that is the newest frame
    ReceivedWork received;
    std::uint64_t spare_memory = 0;  // bytes that detail of the frame being decoded may take, beside what is counted
    ShownFrame shown;
};

// The topology number for a frame whose triangles differ from those of all others.
inline std::uint32_t new_topology(DecoderState& state) {
    if (++state.topologies == 0) ++state.topologies;  // wraps after 2^32; 0 means none
    return state.topologies;
}

// Makes this the mesh that is shown, or what is there of it. reference_topology: of the whole mesh. The mesh is not
// copied: if the object is moved later, its arrays must stay in place, as those of a std::vector do. Throws only
// std::bad_alloc; then nothing is shown.
void show(DecoderState& state, const LatticeMeshView& mesh, std::uint32_t reference_topology, Pose pose);

// The mesh, with its detail, and the charts of the frame's layer; nothing if the stream or an I-frame has none. before:
// the coordinates of the first triangles, which a TP-frame keeps.
Result<TexturedSurface> read_charts(const DecoderState& state, const FramePayloadView& payload, const LatticeMesh& mesh,
                                    const SurfaceDetail& detail, std::vector<CornerTexcoords> before = {});

// How the camera saw an I-frame; nothing if the stream's texture is no film, or the frame does not say it.
Result<std::optional<FilmProjection>> read_projection(const DecoderState& state, const FramePayloadView& payload,
                                                      const LatticeMesh& mesh);

// An error if the packet does not refer to the current I-frame.
Result<void> check_reference(const DecoderState& state, const Packet& packet);

Rotation to_rotation(const RotationMatrix& matrix);
Pose to_pose(const CodedPose& pose, const Lattice& lattice);
Rotation product(const Rotation& a, const Rotation& b);

// Stand-ins for a missing frame, shown as if decoded. False if there is nothing to derive one from.
bool show_unreferred_intra(DecoderState& state);
bool show_hidden(DecoderState& state, std::uint32_t frame);  // the frame itself: an earlier packet brought it
bool show_last_tracked(DecoderState& state);
bool show_moved_by_bones(DecoderState& state);

}  // namespace htvm::internal
