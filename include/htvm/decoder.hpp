// The decoder: packets in, meshes out. It depends only on the standard library. Once constructed, it never throws.
//
//   htvm::Decoder decoder;
//   for each packet:  auto frame = decoder.decode(packet);   // Result<std::optional<FrameView>>
//                     if (frame && *frame) draw((*frame)->mesh, (*frame)->topology);
//
// decode() lends the frame: its arrays belong to the decoder, which reuses them for the next frame. decode_copy()
// returns a copy that the caller owns.
//
// What a frame needs, and what may be left out, is in dependency.hpp: EP- and P-frames refer only to I-frames (and to
// codebook packets), so any of them may be left out; a lost codebook costs the frames that use it, until the next one.
// T-frames refer to the reference, the last I- or TP-frame, or, by default, to the previous T-frame: then a lost one
// costs those up to the next frame that refers to the reference alone, or is one. A decoder may start at any I-frame
// once it has the sequence header.
//
// Threads and lifetimes. A decoder is used by one thread at a time; different ones at the same time. Its own threads
// (threads.hpp) end with it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/intra_coder.hpp"
#include "htvm/mesh.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/texture_layout.hpp"
#include "htvm/threads.hpp"

namespace htvm {

struct DecoderOptions {
    // A frame larger than these is refused (ErrorKind::limit) before memory is allocated for it.
    std::uint32_t max_vertices = 1u << 22;   // of a frame
    std::uint32_t max_triangles = 1u << 23;  // of a frame
    std::uint32_t max_joints = 1024;         // of the skeleton; the format allows no more
    std::uint32_t max_bones = 1024;          // likewise
    std::uint64_t max_packet_bytes = std::uint64_t{1} << 28;
    // Bytes that the decoder may use in total, for what it keeps and for the frame being decoded. It is checked against
    // an upper bound from the counts of vertices and triangles: about 1 KB per vertex of an ordinary mesh. A plugged-in
    // coder of I-frames uses its own memory in addition.
    std::uint64_t max_memory = std::uint64_t{1} << 32;
    // Frames that refer to others take few bytes, however large the mesh is. So the work of decoding them is held
    // against the bytes of all packets so far, in vertices: those shown, and those of what the frame refers to, once
    // for a P-frame, 4 times for a T- and an EP-frame, 16 times for a TP-frame; half of the triangles where these are
    // more.
    std::uint64_t max_vertices_per_byte = 4096;
    // How many levels of detail are shown below the mesh that frames refer to, where a stream has any; with fewer, a
    // frame takes less time and has fewer vertices.
    std::uint32_t detail_levels = 9;
    unsigned threads = 0;  // that work at the same time; 0: one per core. The meshes are the same for any number
    TaskRunner runner;     // provides the threads; empty: the decoder has a pool of its own
    std::optional<ExternalIntraCoder> intra_coder;  // decodes I-frames of another coder; none: they are unsupported
};

// The contents of the sequence header.
struct SequenceInfo {
    std::uint16_t version = 0;  // of the stream
    // Number of this sequence in the stream, from 0. A different header begins another sequence; in joined files, so
    // does a header at which the frame numbers start again.
    std::uint32_t ordinal = 0;
    std::uint64_t session = 0;  // of the live publisher; 0: none
    double lattice_step = 0;    // mm: decoded positions are the origin plus multiples of this
    std::uint32_t fps_numerator = 30, fps_denominator = 1;
    std::uint32_t unit_micrometres = 1000;  // the unit in which the capture was given
    bool has_skeleton = true;               // false: the capture has no skeleton, and one bone stands in for it
    Skeleton skeleton;
    std::vector<double> radii;  // mm, one per bone
    int nearest_vertices = 16;  // m of the distance order
    UpAxis up = UpAxis::unknown;
    std::optional<double> floor;  // mm, coordinate on the axis that is up; none: not known
    std::vector<MetadataEntry> metadata;
    GlobalShift global_shift{};  // mm, taken off the capture's coordinates
    StreamTexture texture;
};

// A frame on loan: valid until the next non-const call on the decoder, or until the decoder is moved or destroyed.
struct FrameView {
    FrameInfo info;
    // Frames with the same number have the same triangles and texture coordinates, so these need not be sent to a
    // graphics card again; but with TextureLayout::projection texture coordinates are others in each frame. T- and
    // P-frames have the number of the I- or TP-frame that is their reference, unless other vertices of it are there
    // (presence); every other frame has a new one. Never 0; numbers of different decoders are unrelated.
    std::uint32_t topology = 0;
    // The number of the mesh of which a frame may show a part. Frames with the same have the same vertices at the same
    // places of the arrays, and, but for TextureLayout::projection, the same texture coordinates; their triangles are
    // those of that mesh whose three vertices are there. It is the frame's topology where all vertices are.
    std::uint32_t reference_topology = 0;
    // One per vertex: 1, or 0 where it is not there. No triangle names such a vertex, and its position is a guess at
    // what nobody saw. Empty: all are there, as in streams before version 7.
    std::span<const std::uint8_t> presence;
    MeshView mesh;  // mm
    // Never null. For an I-frame, the skeleton as sent; for other frames, that of the I-frame moved by the transforms.
    const Pose* pose = nullptr;
    bool concealed = false;  // a stand-in for a missing frame
};

// The same as a copy that the caller owns.
struct DecodedFrame {
    FrameInfo info;
    std::uint32_t topology = 0, reference_topology = 0;
    std::vector<std::uint8_t> presence;
    Mesh mesh;
    Pose pose;
    bool concealed = false;
};
DecodedFrame copy_of(const FrameView& frame);

class Decoder {
public:
    struct State;  // opaque
    explicit Decoder(const DecoderOptions& options = {});
    Decoder(Decoder&&) noexcept;
    Decoder& operator=(Decoder&&) noexcept;
    ~Decoder();

    // Takes one packet, and lends the frame if the packet is one. An error costs that packet only: corrupt_stream if
    // its bytes contradict themselves, or if it refers to an I-frame or codebook that is missing; unsupported; limit if
    // it exceeds the options or memory ran out. What was decoded before a refused packet stays valid, but a frame on
    // loan ends.
    Result<std::optional<FrameView>> decode(const Packet& packet);
    // A stand-in for a frame that did not arrive or could not be decoded: the I-frame's mesh, moved as this frame says
    // if that much of it could be read, else as the last frame; after T-frames, the last of them again; after an
    // I-frame that nothing refers to, that one. Nothing before an I-frame, or if memory ran out.
    std::optional<FrameView> conceal(std::uint32_t frame, std::int64_t timestamp_us);
    // The same as copies that the caller owns.
    Result<std::optional<DecodedFrame>> decode_copy(const Packet& packet);
    std::optional<DecodedFrame> conceal_copy(std::uint32_t frame, std::int64_t timestamp_us);
    // Derives now what the next frame will need of the last one, where that takes long, as behind an I- or TP-frame:
    // for callers with time to spare between two frames. It changes no frame, and a frame on loan stays. It may be left
    // out; the next frame then takes longer.
    void prepare();
    // Sets DecoderOptions::detail_levels for the frames to come.
    void set_detail_levels(std::uint32_t levels);
    // Known once a sequence header has been decoded.
    const std::optional<SequenceInfo>& sequence() const;

private:
    std::unique_ptr<State> state_;
};

// The type of the frame in a packet; nothing if the packet is not a frame.
std::optional<FrameType> frame_type(PacketKind kind);

// A frame packet's counts and layer sizes, without decoding it. For an EP-frame with motion-based coding they count
// what is coded; for a T-frame they are unknown: counts are 0, and all bytes are overhead. DecodedFrame::info has
// everything.
Result<FrameInfo> inspect(const Packet& packet);

}  // namespace htvm
