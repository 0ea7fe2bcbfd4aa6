// The choice of frames by rate and distortion (past the paper): of the ways to code a frame whose surface and colour
// errors are no larger than an I-frame's at the same quality, the one that takes the fewest bits.
#pragma once

#include "codec/encoder_candidates.h"

namespace htvm::internal {

// Surface and colour errors of a decoded frame against the captured mesh, estimated; lattice units, levels.
SurfaceErrors errors_of(const EncoderState& state, FrameUnderWay& frame, const LatticeMesh& decoded);

// An I-frame that knows the errors that the frames of its group are held against.
Result<FrameCandidate> encode_measured_intra(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps);

// P, EP by motion-based coding, EP or I. state.group was begun by encode_measured_intra(). An I-frame is also due where
// the frames since the last one have cost more above the cheapest of them than a new one would.
Result<FrameCandidate> choose_by_cost(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps);

}  // namespace htvm::internal
