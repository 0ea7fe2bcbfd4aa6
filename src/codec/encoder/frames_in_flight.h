// Frames in flight (EncoderOptions::latency_frames): while one frame is coded, other threads go on with the work of
// those that wait behind it, as far as that does not need this one coded. They assume what this frame becomes; what was
// found under another assumption is dropped, so the bytes are those of one frame after the other.
//
//   waits behind one other    in the tracked profile: its search structures; else the motion of its bones
//   waits behind this one     the same if it is missing; then the registration of its nodes; else its vertices,
//   quantised
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "codec/encoder/frame_work.h"

namespace htvm::internal {

// A frame on the lattice, that is coded now or waits, with what was found of it meanwhile.
struct PushedFrame {
    LatticeMesh mesh;
    std::vector<Colour> colours;  // of its vertices where they are not coded
    CodedPose pose;
    std::int64_t timestamp_us = 0;
    bool force_intra = false;
    int effort = usual_effort;
    std::function<bool()> may_repair = {};
    AheadWork ahead = {};
};

// Calls choose(), which chooses the frame of this work, and gives what it gives; beside that, goes on with the frames
// that wait, the next one first. enhanced_steps: see enhanced_steps() in choice/frame_choice.h.
Result<Candidate> choose_beside(FrameWork& work, bool force_intra, const std::optional<FrameSteps>& enhanced_steps,
                                std::vector<PushedFrame>& waiting, const std::function<Result<Candidate>()>& choose);

}  // namespace htvm::internal
