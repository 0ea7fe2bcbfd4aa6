// Which kind of frame a frame becomes, and how coarse (paper, section III-B; past it, by rate and distortion).
#pragma once

#include <functional>
#include <optional>

#include "codec/choice/error_control_enc.h"
#include "codec/choice/rate_control_enc.h"
#include "codec/frame_work_enc.h"

namespace htvm::internal {

// What follows the stream as it grows, where quality follows from a rate or an error. They learn from every attempt;
// what was sent the encoder tells them.
struct QualityControl {
    std::optional<RateController> rate;
    std::optional<ErrorController> error;
};

// Bits of a candidate were it sent next, with all that would come with it, such as the sequence header.
using BitsOf = std::function<double(const Candidate&)>;

// The frame coded the way it is to be sent. Errors: of the mesh or its coding; limit where the rate's buffer cannot
// hold it even at the lowest quality.
Result<Candidate> choose_frame(FrameWork& work, QualityControl& control, const BitsOf& bits_of, bool force_intra);

// As which kind the rate controller counts a candidate: one that stands in costs what it costs, as P-frames do.
FrameType rate_type(const Candidate& candidate);

}  // namespace htvm::internal
