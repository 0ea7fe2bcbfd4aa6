// What the encoder remembers from frame to frame, and what a coded frame changes of it.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "codec/choice/error_control_enc.h"
#include "codec/choice/rate_control_enc.h"
#include "codec/encoder_pose.h"
#include "codec/paper/enhanced_frame_enc.h"
#include "codec/stream/sequence.h"
#include "codec/tracked/captured_surface_enc.h"
#include "codec/tracked/tracked_frame_enc.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/surface_distance.h"

namespace htvm::internal {

// How coarsely a frame is quantised.
struct FrameSteps {
    std::int32_t geometry = 32;  // lattice units
    std::int32_t colour = 6;     // levels
};

// A frame coded in one way. Nothing of the encoder's state changes until it is adopted, so that several ways can be
// compared.
struct FrameCandidate {
    FrameType type = FrameType::intra;
    std::vector<Packet> packets;  // new codebooks first, the frame last; frame numbers are filled in when it is sent
    LatticeMesh decoded;
    CodedPose pose;                   // I: what the reference is skinned with
    double edge = 0;                  // I: mean edge of the captured mesh, lattice units
    std::int32_t intra_step = 1;      // I: of the positions, lattice units
    std::vector<RigidMotion> motion;  // P, EP: of each bone
    Codebooks codebooks;              // EP: as the frame leaves them
    TrackedState tracked;             // T: likewise; motion is then that of the nodes
    std::uint32_t reference = 0;      // T: number of the frame that it refers to
    TrackedFit fit;                   // T, and I that T-frames refer to
    bool in_part = false;             // EP: by motion-based coding
    std::vector<std::uint32_t> distance_order_counts;
    double quality = 50;        // under rate or error control: of the quality knob
    SurfaceErrors plain_intra;  // I, choice by rate and distortion: errors of an I-frame at the steps asked for
    FrameSteps steps;           // as asked for
    std::size_t bytes() const {
        std::size_t sum = 0;
        for (const auto& packet : packets) sum += packet.payload.size() + packet_overhead;
        return sum;
    }
};

// What the frames since the last I-frame refer to.
struct Group {
    ReferenceMesh reference;
    std::optional<ReferenceSearch> search;  // made when the first frame is registered bone by bone
    double edge = 0;                        // mean edge of the I-frame's captured mesh, lattice units
    std::vector<RigidMotion> motion;        // of each bone in the frame before; empty behind the I-frame
    Codebooks codebooks;
    std::optional<TrackedGroup> tracked;        // made when the first T-frame asks for it
    std::optional<std::uint32_t> last_tracked;  // number of the last T-frame
    TrackedFit intra_fit;                       // of the I-frame itself, where T-frames refer to it
    double best_fit = 0;                        // rms of the T-frames since; 0: none yet
    std::int32_t intra_step = 1;                // of the I-frame's positions
    SurfaceErrors plain_intra;  // errors of the I-frame's mesh as an I-frame at `steps` that nothing refers to
    FrameSteps steps;
    double intra_bytes = 0;   // what the I-frame cost
    double least_bytes = 0;   // the cheapest EP-frame since
    double excess_bytes = 0;  // what the others cost above it
};

struct EncoderState {
    EncoderOptions options;
    ThreadPool pool;
    Threads threads = {};  // of the pool
    SequenceHeader header;
    bool begun = false, finished = false;
    PoseTracker poses;
    std::uint32_t next_frame = 0;
    std::uint32_t header_sent = 0;  // number of the frame that the sequence header came with last
    std::optional<std::int64_t> last_timestamp;
    std::optional<Group> group;
    std::optional<RateController> rate;
    std::optional<ErrorController> error;
    FrameCost cost;  // of the last frame

    std::deque<Packet> packets;
    std::uint64_t stream_bytes = 0;
    std::vector<IndexEntry> index;

    FrameInfo info;
    LatticeMesh decoded;
    std::vector<StageTime> stages;
    std::vector<std::uint32_t> distance_order_counts;
};

}  // namespace htvm::internal
