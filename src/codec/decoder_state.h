// What a decoder keeps from frame to frame, and how a decoded mesh comes to be shown.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/paper/codebook.h"
#include "codec/reference/reference.h"
#include "codec/stream/sequence.h"
#include "codec/tracked/tracked_frame.h"
#include "core/thread.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {

// A decoded mesh where it lies, on the lattice: what a frame has in common with its reference is the reference's own.
struct LatticeMeshView {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;
    std::span<const QuantisedNormal> normals;
    std::span<const QuantisedTexcoord> texcoords;
};
inline LatticeMeshView view_of(const LatticeMesh& mesh) {
    return {mesh.positions, mesh.triangles, mesh.colours, mesh.normals, mesh.texcoords};
}

// The frame that was decoded last, in millimetres. The arrays are kept from frame to frame; triangles and colours lie
// where they were decoded to.
struct ShownFrame {
    std::uint32_t topology = 0;  // 0: there is none
    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;
    std::vector<Vector2f> texcoords;
    std::uint32_t texcoords_topology = 0;  // of which frames they are
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;
    LatticeMesh own;  // of a frame that has nothing in common with its reference
    Pose pose;
};

// What EP- and P-frames since the I-frame left.
struct DecodedBones {
    std::vector<QuantisedTransform> transforms;  // of the last, one per bone; empty: none since
    std::optional<NumberedCodebook> geometry_codebook, colour_codebook;
};

// What T-frames since the I-frame left: of the last, and arrays for the next, which takes the place of the one before.
struct DecodedNodes {
    std::optional<std::uint32_t> frame;  // number of the last; none: none since
    DecodedTrackedFrame last, next;
    Pose pose;
};

struct DecoderState {
    DecoderOptions options;
    ThreadPool pool;
    Threads threads = {};  // of the pool
    std::optional<SequenceHeader> header;
    std::vector<std::uint8_t> header_payload;
    std::optional<SequenceInfo> info;
    std::optional<Reference> reference;
    std::uint32_t reference_topology = 0;
    std::uint32_t topologies = 0;  // given out so far
    DecodedBones bones;
    DecodedNodes tracked;
    ShownFrame shown;
};

// The number of a frame whose triangles are like no other's.
inline std::uint32_t new_topology(DecoderState& state) {
    if (++state.topologies == 0) ++state.topologies;  // after 2^32 of them; 0 is none
    return state.topologies;
}

// Makes the mesh the one that is shown. It is lent: where it moves afterwards, its arrays must stay where they are, as
// those of a std::vector do. Throws std::bad_alloc, nothing else; nothing is shown then.
void show(DecoderState& state, const LatticeMeshView& mesh, std::uint32_t topology, Pose pose);

// An error where the packet does not refer to the I-frame in force.
Result<void> check_reference(const DecoderState& state, const Packet& packet);

Rotation to_rotation(const RotationMatrix& matrix);
Rotation product(const Rotation& a, const Rotation& b);

// Stand-ins for a frame that is missing: shown as if decoded. False where there is nothing to go by.
bool show_last_tracked(DecoderState& state);
bool show_moved_by_bones(DecoderState& state);

}  // namespace htvm::internal
