// Decides which kind of frame a frame becomes and how coarsely it is quantised (paper, section III-B; beyond it, by
// rate and distortion).
#pragma once

#include <functional>
#include <optional>

#include "codec/encoder/control/error_control.h"
#include "codec/encoder/control/rate_control.h"
#include "codec/encoder/frame_work.h"

namespace htvm::internal {

// The controllers through which quality follows from a rate or an error. They learn from every attempt; the encoder
// tells them what was sent.
struct QualityControl {
    std::optional<RateController> rate;
    std::optional<ErrorController> error;
};

// The bits of a candidate if it were sent next, including everything sent along, such as the sequence header.
using BitsOf = std::function<double(const Candidate&)>;

// Codes the frame as it will be sent. Errors: those of the mesh or its coding; `limit` if the frame does not fit the
// buffer even at the lowest quality.
Result<Candidate> choose_frame(FrameWork& work, QualityControl& control, const BitsOf& bits_of, bool force_intra);

// The steps at which the next EP-frame's whole surface is quantised first, if that follows from the options alone.
std::optional<FrameSteps> enhanced_steps(const Configuration& configuration);

// The kind that the rate controller takes a candidate for: a stand-in's size does not depend on quality, like that of a
// P-frame.
FrameType rate_type(const Candidate& candidate);

}  // namespace htvm::internal
