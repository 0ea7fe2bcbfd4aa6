// The encoder: for each frame push a mesh and a pose, then pull packets.
//
//   auto encoder = htvm::Encoder::create(options);        // Result<Encoder>
//   encoder->push(mesh, &pose, timestamp_us);             // Result<void>
//   while (auto packet = encoder->pull()) send(htvm::write_packet(*packet));
//   encoder->finish();                                    // then pull the rest
//
// With EncoderOptions::latency_frames a push queues the packets of an earlier frame. Where T-frames are coded in groups
// (TrackedOptions::group), frames are held until their group is whole: a push may queue the packets of none, or of
// several. Memory is bounded by a few frames, whatever the length of the sequence.
//
// Threads and lifetimes. An encoder is used by one thread at a time; different ones at the same time. Its own threads
// (threads.hpp) end with it. What push() is given is not needed behind it, and what pull() gives is the caller's; what
// else it lends is valid until the next call that changes it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/encoder_options.hpp"
#include "htvm/frame.hpp"
#include "htvm/mesh.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/stage_time.hpp"

namespace htvm {

struct CalibrationOptions {
    double percentile = 70;  // of the distances of a bone's vertices. The paper takes the maximum, 100, which one stray
                             // vertex can triple; 50 to 80 measured best, with up to a third fewer bits
};
// Skinning calibration (paper, section IV-A, eq. 3): the radius r^i of each bone's cylinder, in mm, from a mesh in
// T-pose and its skeleton. Bones that no vertex projects onto get 0.
Result<std::vector<double>> calibrate(const Mesh& mesh, const Skeleton& skeleton, const Pose& pose,
                                      const CalibrationOptions& options = {});

// A frame whose packet was queued.
struct EncodedFrame {
    FrameInfo info;
    FrameCost cost;
};

class Encoder {
public:
    struct State;  // opaque
    // bad_input if an option is out of range or contradicts another.
    static Result<Encoder> create(const EncoderOptions& options);
    Encoder(Encoder&&) noexcept;
    Encoder& operator=(Encoder&&) noexcept;
    ~Encoder();

    // Fixes, before the first push(), what otherwise follows from the first frame pushed: the lattice's origin, the
    // subject's size, the bones' radii. `first` is not coded. Encoders of different parts of a capture that begin with
    // the same mesh write the same sequence header, so their streams can be joined to one sequence. Errors: as push().
    Result<void> begin(const Mesh& first, const Pose* pose);
    // Codes one frame; with EncoderOptions::latency_frames an earlier one, to which any error then belongs. pose: of
    // the skeleton in the options; null if the tracker lost it, and then the last one is kept. Timestamps must ascend.
    // After an error the frame is not part of the stream, and the next may be pushed. Under rate control, a frame that
    // does not fit the buffer even at the lowest quality is a limit error.
    Result<void> push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra = false);
    // Sets the bits per second that the line carries from the next frame on; the quality follows within half a second.
    // A buffer of rate.buffer_seconds then holds as much of the new rate. bad_input unless the options gave a rate, and
    // if this is none that they could have given.
    Result<void> set_bitrate(double bits_per_second);
    // Sets how much is searched for each frame from the next on: 1 to 9, as TrackedOptions::effort; groups keep their
    // length. 0 is for a frame that would be late otherwise: its motion alone is coded, and what tracking loses there
    // is mended by a later one, unless the picture would fall apart. The same efforts for the same frames give the same
    // bytes. bad_input if it is out of range, or with another profile than tracked.
    Result<void> set_effort(int effort);
    // Sets who decides, for the frames pushed from here on, whether lost tracking is repaired at once, by a patch or an
    // I-frame, which takes three to ten times as long as other frames. may_repair is called while a frame is coded,
    // from the thread that pushes or one of the encoder's, once tracking turns out to be lost in it. On false the frame
    // is sent as it was tracked, and a later one asks anew. Where the picture would fall apart, 4 mm off all over or 30
    // mm in a region of 10 cm of an adult, it is not called, and the frame is repaired. Null: all are repaired. The
    // same answers give the same bytes. bad_input with another profile than tracked.
    Result<void> set_repair(std::function<bool()> may_repair);
    // The next frame pushed becomes one where decoding can start, for whoever has what it refers to, whatever
    // TrackedOptions::access_interval says. Segments of several encoders that begin with the same frames begin so.
    void request_access();
    // Before the first push: what `first` finds of a frame that both are pushed, `first` before this one, this one goes
    // by, which saves it time: search structures, and where the surface moved. For the same capture in several
    // qualities; the stream may differ a little from what it is otherwise. They are used by one thread at a time
    // together. bad_input if either has begun, or has another profile than tracked, or `first` goes by a third one.
    Result<void> share_with(Encoder& first);
    // Ends the sequence: codes what is held, and queues the index of I-frames. After an error nothing has ended.
    Result<void> finish();
    // The next packet in stream order; nothing if more must be pushed first.
    std::optional<Packet> pull();

    // The frames whose packets the last push() or finish() queued, in the order of the stream: one for each push() but
    // where T-frames are coded in groups.
    std::span<const EncodedFrame> coded_frames() const;
    // How many frames were pushed whose packets are still to come.
    std::size_t held_frames() const;
    // About the last frame whose packet was queued: its type and sizes, and the mesh that the decoder will show.
    const FrameInfo& last_frame() const;
    FrameCost last_cost() const;
    Mesh reconstruction() const;
    Mesh reconstruction(std::size_t coded) const;  // the same for one of coded_frames()
    // Which vertices the last ones of the reconstruction repeat, at the seams of its charts: these lie at the same
    // positions. Empty without charts.
    std::span<const std::uint32_t> repeated_vertices() const;
    std::span<const std::uint32_t> repeated_vertices(std::size_t coded) const;
    // Bounds of the reconstructions of all frames queued with the last one; nothing if they have no vertices.
    std::optional<SpaceBounds> bounds() const;
    // How long the stages of the last push() or finish() took.
    const std::vector<StageTime>& stage_times() const;
    // About the last EP-frame: how often each distance order was coded, the escapes last (paper, Fig. 23).
    const std::vector<std::uint32_t>& distance_order_counts() const;

private:
    explicit Encoder(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
