// Which kind of frame a frame of the bones strategy becomes (paper, section III-B; beyond it, by rate and distortion).
#pragma once

#include <optional>

#include "codec/encoder/bones/bones_work.h"

namespace htvm::internal {

// The kind that is expected before anything is coded.
FrameType expected_type(const BonesWork& work);

// The frame, coded at these steps in the way that suits it. Errors: those of the mesh or its coding.
Result<BonesWork::Frame> choose(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps);

// The cheapest frame there is, where the reference can be moved: a P-frame.
Result<BonesWork::Frame> code_stand_in(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps);

// The distance between what is shown of a frame and the captured mesh.
SurfaceErrors errors_of(const BonesWork& work, const CodedFrame& frame);

// The steps at which the next EP-frame's whole surface is quantised first, if that follows from the options alone.
std::optional<FrameSteps> enhanced_steps(const Configuration& configuration);

}  // namespace htvm::internal
