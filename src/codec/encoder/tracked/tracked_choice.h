// Which kind of frame a frame of the tracked strategy becomes: a T-frame, as long as it fits the capture; where it does
// not, a TP- or an I-frame.
#pragma once

#include "codec/encoder/tracked/tracked_work.h"

namespace htvm::internal {

// The kind that is expected before anything is coded.
FrameType expected_type(const TrackedWork& work);

// The frame, coded at these steps in the way that suits it. Errors: those of the mesh or its coding.
Result<TrackedWork::Frame> choose(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps);

// The cheapest frame there is, where the reference can be moved: the motion of its nodes alone.
Result<TrackedWork::Frame> code_stand_in(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps);

// The distance between what is shown of a frame and the captured mesh.
SurfaceErrors errors_of(const TrackedWork& work, const CodedFrame& frame);

}  // namespace htvm::internal
