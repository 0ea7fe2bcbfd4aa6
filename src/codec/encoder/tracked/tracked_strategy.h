// The tracked strategy: I-, T- and TP-frames, and groups of T-frames. A frame's way through it, in order: begin_work(),
// choose() (tracked_choice.h), sequence_after(), hand_out(), commit(). Groups: T-frames that were chosen are held until
// their group is whole, which then is coded anew.
//
// Frames in flight (EncoderOptions::latency_frames): while one frame is coded, other threads go on with the work of
// those that wait behind it, as far as that does not need this one coded: first the search structures of each, then the
// registration of the next one. That assumes that this frame becomes a T-frame whose nodes move as they were first
// registered; what was found under another assumption is dropped, so the bytes are those of one frame after the other.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/tracked/group_coder.h"
#include "codec/encoder/tracked/tracked_choice.h"
#include "codec/encoder/tracked/tracked_work.h"

namespace htvm::internal {

struct TrackedStrategy {
    using Work = TrackedWork;
    using Sequence = TrackedSequence;
    // A frame that waits, with what was found of it meanwhile.
    struct Waiting {
        CapturedFrame captured;
        TrackedAhead ahead = {};
    };

    TrackedSequence sequence;
    std::vector<Waiting> waiting;       // in their order
    std::vector<HeldFrame> held;        // T-frames of the group that is not whole yet
    std::optional<GroupAnchor> anchor;  // what the next group may refer to; none: the reference alone
};

// 1. What is found of the frame before it is coded: its search structures and, where it may refer to the reference, how
// that lies on it. What was found while it waited is not found again. Derives what a TP-frame left to derive.
TrackedWork begin_work(const Configuration& configuration, TrackedStrategy& strategy, TrackedStrategy::Waiting frame,
                       Tracking& tracking, std::vector<StageTime>& stages);

// Beside 2., the choice. What is taken for granted of the frame that is coded: that its nodes move so, unless that is
// not known before it is coded.
struct TrackedAssumption {
    std::optional<NodeRegistration> nodes;
};
TrackedAssumption assume(const TrackedWork& work, const Tracking& tracking);
// Goes on with the frames that wait, one or two, the next one first. Not finished once this frame is found lost.
void work_ahead(const TrackedWork& work, const Tracking& tracking, const TrackedAssumption& assumed,
                std::span<TrackedStrategy::Waiting> waiting, std::vector<StageTime>& stages);
// Drops what does not hold for what the frame became; chosen: null after an error.
void keep_what_holds(const Tracking& tracking, const TrackedWork::Frame* chosen,
                     std::span<TrackedStrategy::Waiting> waiting);

// 3. The sequence after this frame; what the frame leaves for it is moved into it. Errors: those of make_reference().
Result<TrackedSequence> sequence_after(const TrackedWork& work, TrackedWork::Frame& chosen);

// 4. What becomes of it: frames whose packets are ready, and what the strategy is left with.
struct TrackedHandout {
    std::vector<OutgoingFrame> frames;
    std::optional<GroupAnchor> anchor;
    bool keeps_held = false;  // whether the held frames go on waiting
};
// A T-frame that is to be in a group takes the work and its registration along. cost: as it would be sent by itself.
// After an error `strategy.held` may have one frame more than before.
Result<TrackedHandout> hand_out(TrackedStrategy& strategy, TrackedWork& work, Tracking& tracking,
                                TrackedWork::Frame chosen, const FrameCost& cost);
// The held frames as a group, at the sequence's end.
Result<TrackedHandout> hand_out_held(const TrackedStrategy& strategy, const Configuration& configuration,
                                     std::vector<StageTime>& stages);

// 5. Nothing can fail here.
void commit(TrackedStrategy& strategy, TrackedHandout& handout, TrackedSequence sequence);

}  // namespace htvm::internal
