// The coder of each kind of frame: turns the work of a frame into a candidate of that kind.
#pragma once

#include <array>
#include <vector>

#include "codec/frame_work_enc.h"

namespace htvm::internal {

// Whether later frames may refer to an I-frame. One that stands alone is quantised exactly with the steps asked for.
enum class IntraUse : std::uint8_t { reference, alone };
Result<Candidate> code_intra(FrameWork& work, const FrameSteps& steps, IntraUse use);

// The coders below need a reference that has a vertex and the same attributes as the frame.
Result<Candidate> code_predicted(FrameWork& work);
Result<Candidate> code_enhanced(FrameWork& work, const FrameSteps& steps);
// Motion-based coding: an EP-frame in which some bones are coded and the seams zippered, a P-frame if none is coded, a
// whole EP-frame if nothing would be left to animate. coded: one per bone.
Result<Candidate> code_coded_bones(FrameWork& work, const FrameSteps& steps, const std::vector<bool>& coded);

// Which parts of a T-frame are sent.
enum class TrackedParts : std::uint8_t { all, motion_alone };
Result<Candidate> code_tracked(FrameWork& work, const FrameSteps& steps, TrackedParts parts);

// The coder column of the table of frame kinds (frame_kinds.h), indexed by FrameType. Each coder codes a whole frame,
// to which later frames may refer as far as its kind allows.
using FrameCoder = Result<Candidate> (*)(FrameWork& work, const FrameSteps& steps);
extern const std::array<FrameCoder, frame_type_count> frame_coders;

}  // namespace htvm::internal
