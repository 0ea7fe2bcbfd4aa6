// Which kind of frame a frame becomes, and how coarse (paper, section III-B; past it, by rate and distortion).
#pragma once

#include "codec/encoder_candidates.h"

namespace htvm {

// The frame coded the way it is to be sent; nothing is adopted yet.
Result<FrameCandidate> code_frame(Encoder::State& state, FrameUnderWay& frame, bool force_intra);

// Of a candidate, were it sent next: with the sequence header where it is the first.
double bits_of(const Encoder::State& state, const FrameCandidate& candidate);

}  // namespace htvm
