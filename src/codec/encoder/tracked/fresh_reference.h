// Whether to begin anew though nothing is lost. Studios that track a person do so for a second or two, then begin anew
// with another mesh, whose surface differs from the one before by a millimetre here and there: less than counts as
// lost, but T-frames stay that far off from then on, while those of an I-frame of the new mesh would be as near as
// those of the last I-frame were.
#pragma once

#include <optional>

#include "codec/encoder/tracked/tracked_coders.h"
#include "codec/encoder/tracked/tracked_work.h"

namespace htvm::internal {

// What is known of the capture with this frame. vertices_again: NodeRegistration's.
FollowedCapture followed_on(FollowedCapture followed, double vertices_again);
// The same behind an I-frame.
FollowedCapture followed_from_intra(FollowedCapture followed);

// The I-frame that is worth its bytes in place of this T-frame, where the capture is begun anew with it; nothing if
// there is none, or if bits, errors or times are asked for that such I-frames would upset. lost: whether it does not
// fit. steps: asked for. followed: of this frame; goes on with what is found. Few frames are measured, each in half of
// a T-frame's time.
Result<std::optional<TrackedIntra>> fresh_reference(const TrackedWork& work, const CodedMotion& frame, bool lost,
                                                    const FrameSteps& steps, FollowedCapture& followed);

}  // namespace htvm::internal
