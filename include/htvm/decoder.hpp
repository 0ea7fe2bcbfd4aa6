// The decoder: packets in, meshes out. It depends on the standard library alone. Once made, it never throws.
//
//   htvm::Decoder decoder;
//   for each packet:  auto frame = decoder.decode(packet);   // Result<std::optional<FrameView>>
//                     if (frame && *frame) draw((*frame)->mesh, (*frame)->topology);
//
// What decode() gives is lent: the arrays are the decoder's, used again for the next frame. push() gives a copy.
//
// EP- and P-frames refer to I-frames (and to codebook packets) alone: any of them may be left out, but a lost codebook
// costs the frames that name it, until the next one. T-frames refer to the I-frame or, by default, to the T-frame
// before: a lost one then costs those up to the next that refers to an I-frame. A decoder may start at any I-frame once
// it has seen the sequence header.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/intra_coder.hpp"
#include "htvm/mesh.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/threads.hpp"

namespace htvm {

struct DecoderOptions {
    // What is larger is refused (ErrorKind::limit) before memory is taken for it.
    std::uint32_t max_vertices = 1u << 22;   // of a frame
    std::uint32_t max_triangles = 1u << 23;  // of a frame
    std::uint32_t max_joints = 1024;         // of the skeleton; the format has no more
    std::uint32_t max_bones = 1024;          // likewise
    std::uint64_t max_packet_bytes = std::uint64_t{1} << 28;
    // Bytes that the decoder may take for what it keeps and the frame under way together, by an upper bound from the
    // counts of vertices and triangles: about 1 KB a vertex of an ordinary mesh. A coder of I-frames that is plugged in
    // takes its own besides.
    std::uint64_t max_memory = std::uint64_t{1} << 32;
    unsigned threads = 0;  // at work at once; 0: one per core; the meshes are the same for any number
    TaskRunner runner;     // gives the threads; none: a pool of the decoder's own
    std::optional<ExternalIntraCoder> intra_coder;  // for I-frames of another coder; none: they are unsupported
};

// What the sequence header says.
struct SequenceInfo {
    double lattice_step = 0;  // mm: decoded positions are multiples of it from the origin
    std::uint32_t fps_numerator = 30, fps_denominator = 1;
    std::uint32_t unit_micrometres = 1000;  // the unit that the capture came in
    bool skeleton_tracked = true;           // false: one bone stands in for a skeleton that the capture has not
    Skeleton skeleton;
    std::vector<double> radii;  // mm, one a bone
    int nearest_vertices = 16;  // m of the distance order
};

// A frame that is lent: valid until the decoder is next told to do anything but tell, or is moved or destroyed.
struct FrameView {
    FrameInfo info;
    // Frames of the same number have the same triangles and texture coordinates: whoever has sent those to a graphics
    // card need not send them again. T- and P-frames have their I-frame's number, every other frame one of its own.
    // Never 0; another decoder gives other numbers.
    std::uint32_t topology = 0;
    MeshView mesh;  // mm
    // Never null. Of an I-frame, the skeleton as sent; of the others, the I-frame's moved by the transforms.
    const Pose* pose = nullptr;
    bool concealed = false;  // a stand-in
};

// The same, the caller's own.
struct DecodedFrame {
    FrameInfo info;
    std::uint32_t topology = 0;
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

    // Takes one packet; lends the frame that it is, where it is one. Errors cost that packet only: corrupt_stream where
    // its bytes contradict themselves, or it refers to an I-frame or codebook that is not there; unsupported; limit
    // where it is beyond the options, or memory ran out. What came before a packet that is refused stays in force,
    // but a frame that was lent is gone.
    Result<std::optional<FrameView>> decode(const Packet& packet);
    // A stand-in for a frame that did not arrive or could not be decoded: the I-frame's mesh moved as the last frame
    // was, or, where that much of a frame could be read, as it is itself; after T-frames, the last of them again.
    // Nothing before an I-frame, or where memory ran out.
    std::optional<FrameView> stand_in(std::uint32_t frame, std::int64_t timestamp_us);
    // decode() and stand_in(), copied.
    Result<std::optional<DecodedFrame>> push(const Packet& packet);
    std::optional<DecodedFrame> conceal(std::uint32_t frame, std::int64_t timestamp_us);
    // Known once a sequence header was decoded.
    const std::optional<SequenceInfo>& sequence() const;

private:
    std::unique_ptr<State> state_;
};

// The kind of frame that a packet is, or nothing where it is none.
std::optional<FrameType> frame_type(PacketKind kind);

// The layer sizes of a frame packet without decoding it, for inspection. Of an EP-frame by motion-based coding,
// vertices and triangles are those coded; DecodedFrame::info has those of the whole mesh.
Result<FrameInfo> inspect(const Packet& packet);

}  // namespace htvm
