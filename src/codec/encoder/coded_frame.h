// A frame's way through the encoder, as far as it is the same with either strategy: captured, coded in some way, sent.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "codec/encoder/configuration.h"
#include "codec/format/frame_payload.h"
#include "codec/reference/film_projection.h"
#include "codec/reference/node_reference.h"
#include "codec/reference/reference.h"
#include "codec/reference/textured_surface.h"
#include "codec/reference/transforms.h"
#include "core/lattice.h"
#include "core/stage_clock.h"
#include "htvm/encoder.hpp"
#include "htvm/packet.hpp"
#include "surface/surface_distance.h"
#include "surface/surface_index.h"

namespace htvm::internal {

// As it was pushed, on the lattice.
struct CapturedFrame {
    LatticeMesh mesh;
    std::vector<Colour> colours;  // of its vertices where they serve tracking but are not coded; or none
    CodedPose pose;
    std::optional<FilmProjection> projection;  // how the camera saw it, where the texture is its film
    std::int64_t timestamp_us = 0;
    bool force_intra = false;
    bool force_access = false;              // Encoder::request_access()
    int effort = TrackedOptions{}.effort;   // Encoder::set_effort()
    std::function<bool()> may_repair = {};  // Encoder::set_repair()
};

// Coded in one way: what controlling its size, showing it and sending it take. Packets are numbered when it is sent.
struct CodedFrame {
    FrameType type = FrameType::intra;
    std::vector<Packet> packets;   // new codebooks first, the frame last
    std::uint32_t reference = 0;   // number of the frame that it refers to; of an I-frame, its own
    bool referred = false;         // whether later frames may refer to it
    bool access = true;            // whether it is an I-frame or refers to a reference
    bool of_tracked_mesh = false;  // I: whether it was made of that, not of the capture
    LatticeMesh decoded;           // the mesh that the decoder will have, without detail and the seams of charts
    Presence presence;             // what of it is there; none: all is
    TexturedSurface textured;      // I, TP: of `decoded`, if the stream has charts
    std::optional<FilmProjection> projection;  // that it says, where the texture is a camera's film
    SurfaceDetail detail;                      // I, TP: of `decoded`, with which it is shown
    CapturedCounts captured;                   // of the mesh that it was made of
    LayerBytes shares;                         // of a payload that is a run (FrameRules::is_run): its layers' bytes
    double renewed = 0;                        // TP: the share of its vertices that are new
    double quality = 50;                       // the quality setting used, under rate or error control
    bool stands_in = false;                    // motion alone, because nothing better fits the buffer
    std::size_t bytes() const;
};

// How rate control takes it: the size of a stand-in does not depend on quality, like that of a P-frame, and a frame
// without a surface says nothing of what others take.
FrameType rate_type(const CodedFrame& frame);

// The detail with which a frame is shown. reference: that it refers to, or null.
const SurfaceDetail& detail_of(const CodedFrame& frame, const Reference* reference);

// A mesh as the decoder shows it.
struct ShownMesh {
    LatticeMesh mesh;
    std::vector<std::uint32_t> repeated;  // at the seams of charts: which vertices the last ones are
};

// A frame whose packets are numbered, to be queued behind those before it.
struct OutgoingFrame {
    std::vector<Packet> packets;
    FrameInfo info;
    FrameCost cost;
    ShownMesh shown;
    bool starts_decoding = false;  // whether the index names it
};
// reference: that the frame shows, or null. cost: of the frame, its header's included.
OutgoingFrame outgoing(const Configuration& configuration, CodedFrame frame, const Reference* reference,
                       std::uint32_t number, std::int64_t timestamp_us, const FrameCost& cost);

// The reason of an I-frame of this number that is due. The first frame of a stream, and a stream of I-frames, need
// none.
FrameReason reason_of_due(const Configuration& configuration, std::uint32_t number);

Packet frame_packet(PacketKind kind, std::vector<std::uint8_t> payload);
// reason: of an I- or TP-frame, which says so if there is one.
Packet frame_packet(PacketKind kind, FramePayload payload, FrameReason reason = FrameReason::none);

CapturedCounts counts_of(const LatticeMesh& captured);

// If frames refer to an I-frame, its step is at most half an edge: they then save more than the finer step costs. At
// 8 mm and 35,000 vertices this takes a fifth fewer bits at the same error.
std::int32_t step_for_reference(double edge, std::int32_t step);

// Says in an I-frame's payload what it was captured with.
void tell_captured(FramePayload& payload, CapturedCounts captured, const CodedPose& pose);

// An I-frame's mesh, coded; charts and packet are still to be added.
struct CodedIntra {
    FramePayload payload;
    LatticeMesh decoded;
    SurfaceDetail detail;
    std::int32_t step = 1;  // of the reference that it becomes: Reference::step
};
// steps: of the quantisers. renewal: the mesh was smoothed when its reference was decoded. captured, pose: what the
// payload says of them. Errors: those of encode_intra_frame().
Result<CodedIntra> code_intra_mesh(const Configuration& configuration, const LatticeMesh& mesh, const FrameSteps& steps,
                                   bool renewal, CapturedCounts captured, const CodedPose& pose);

// The distance between a decoded mesh and the captured one, in both directions. surface: index of `captured`.
SurfaceErrors errors_between(const LatticeMesh& captured, const SurfaceIndex& surface, const LatticeMesh& decoded,
                             Threads threads);

// Whether two meshes have the same attributes, so that one can be moved to stand for the other.
bool same_attributes(const LatticeMesh& a, const LatticeMesh& b);

}  // namespace htvm::internal
