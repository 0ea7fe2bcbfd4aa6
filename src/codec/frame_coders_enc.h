// The coder of each kind of frame: from the work of a frame to a candidate of that kind.
#pragma once

#include <array>
#include <vector>

#include "codec/frame_work_enc.h"

namespace htvm::internal {

// Whether later frames may refer to an I-frame. One that nothing refers to takes the steps asked for as they are.
enum class IntraUse : std::uint8_t { reference, alone };
Result<Candidate> code_intra(FrameWork& work, const FrameSteps& steps, IntraUse use);

// The rest need a reference that has a vertex and the frame's attributes.
Result<Candidate> code_predicted(FrameWork& work);
Result<Candidate> code_enhanced(FrameWork& work, const FrameSteps& steps);
// Motion-based coding: EP where some bones are coded, and the seams zippered; P where none is, a whole EP-frame where
// nothing would be left to animate. coded: one per bone.
Result<Candidate> code_coded_bones(FrameWork& work, const FrameSteps& steps, const std::vector<bool>& coded);

// What of a T-frame is sent.
enum class TrackedParts : std::uint8_t { all, motion_alone };
Result<Candidate> code_tracked(FrameWork& work, const FrameSteps& steps, TrackedParts parts);

// The coder's column of the table of frame kinds (frame_kinds.h), by FrameType: each codes a whole frame that later
// ones may refer to as far as its kind allows.
using FrameCoder = Result<Candidate> (*)(FrameWork& work, const FrameSteps& steps);
extern const std::array<FrameCoder, frame_type_count> frame_coders;

}  // namespace htvm::internal
