// Which kind of frame a frame becomes, and how coarse (paper, section III-B; past it, by rate and distortion).
#pragma once

#include "codec/encoder_candidates.h"

namespace htvm::internal {

// The frame coded the way it is to be sent; nothing is adopted yet.
Result<FrameCandidate> code_frame(EncoderState& state, FrameUnderWay& frame, bool force_intra);

// Whether the sequence header goes before the candidate: the first frame, and I-frames now and then, so that who joins
// later, or lost it, can begin there.
bool brings_header(const EncoderState& state, const FrameCandidate& candidate);

// Of a candidate, were it sent next: with the sequence header where it brings one.
double bits_of(const EncoderState& state, const FrameCandidate& candidate);

}  // namespace htvm::internal
