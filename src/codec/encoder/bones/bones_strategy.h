// The bones strategy: I-, EP- and P-frames, as published. A frame's way through it, in order: begin_work(), choose()
// (bones_choice.h), sequence_after(), hand_out(), commit().
//
// Frames in flight (EncoderOptions::latency_frames): while one frame is coded, other threads go on with the work of
// those that wait behind it, as far as that does not need this one coded: the motion of the bones of each, then the
// next one's vertices, quantised. That assumes that this frame becomes an EP- or P-frame whose bones move as they were
// registered, an EP-frame that leaves these codebooks; what was found under another assumption is dropped, so the bytes
// are those of one frame after the other.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/bones/bones_choice.h"
#include "codec/encoder/bones/bones_work.h"

namespace htvm::internal {

struct BonesStrategy {
    using Work = BonesWork;
    using Sequence = BonesSequence;
    // A frame that waits, with what was found of it meanwhile.
    struct Waiting {
        CapturedFrame captured;
        BonesAhead ahead = {};
    };

    BonesSequence sequence;
    std::vector<Waiting> waiting;                      // in their order
    std::vector<std::uint32_t> distance_order_counts;  // of the last EP-frame; none behind another frame
};

// What was found of the frame while it waited goes into the work and the progress.
BonesWork begin_work(const Configuration& configuration, const BonesStrategy& strategy, BonesStrategy::Waiting frame,
                     BonesProgress& progress, std::vector<StageTime>& stages);

// Beside the choice. What is taken for granted of the frame that is coded, as far as it is known before.
struct BonesAssumption {
    std::optional<std::vector<RigidMotion>> motion;
    std::optional<Codebooks> codebooks;
    FrameSteps steps;  // with codebooks
};
// Quantises the frame, if it is expected to become a whole EP-frame.
BonesAssumption assume(const BonesWork& work, BonesProgress& progress);
// Goes on with the frames that wait, one or two, the next one first.
void work_ahead(const BonesWork& work, const BonesProgress& progress, const BonesAssumption& assumed,
                std::span<BonesStrategy::Waiting> waiting, std::vector<StageTime>& stages);
// Drops what does not hold for what the frame became; chosen: null after an error.
void keep_what_holds(const BonesProgress& progress, const BonesWork::Frame* chosen,
                     std::span<BonesStrategy::Waiting> waiting);

// The sequence after this frame; what the frame leaves for it is moved into it. Errors: those of make_reference().
Result<BonesSequence> sequence_after(const BonesWork& work, BonesWork::Frame& chosen);

struct BonesHandout {
    std::vector<OutgoingFrame> frames;
    std::vector<std::uint32_t> distance_order_counts;
};
Result<BonesHandout> hand_out(const BonesStrategy& strategy, const BonesWork& work, const BonesProgress& progress,
                              BonesWork::Frame chosen, const FrameCost& cost);

// Nothing can fail here.
void commit(BonesStrategy& strategy, BonesHandout& handout, BonesSequence sequence);

}  // namespace htvm::internal
