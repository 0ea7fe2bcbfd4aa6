// Whether to begin anew though nothing is lost: T-frames follow a reference worse and worse, and often those of a new
// one would be nearer, as where a studio's tracking began anew. Where somebody only begins to move faster they would
// not, so it is tried: on the frame that was measured last, which is as far from the new reference as later ones will
// be.
#pragma once

#include <cstddef>
#include <optional>

#include "codec/encoder/tracked/tracked_work.h"

namespace htvm::internal {

// A T- or TP-frame as it would be sent.
struct FrameToBeat {
    const LatticeMesh& decoded;
    const SurfaceDetail& detail;  // with which it is shown
    std::size_t bytes = 0;        // of a T-frame
};

// The I-frame that is worth its bytes in place of this frame; nothing if there is none, if it is not this frame's turn
// to be measured, or if bits, errors or times are asked for that such I-frames would upset. steps: asked for. followed:
// goes on with what is found. Takes little time but for a trial, which takes that of an I- and a T-frame.
Result<std::optional<TrackedIntra>> fresh_reference(const TrackedWork& work, const FrameToBeat& frame,
                                                    const FrameSteps& steps, FollowedError& followed);

}  // namespace htvm::internal
