// The second pass's plan: a quality for every frame of a sequence whose costs a first pass has found.
#pragma once

#include <span>
#include <vector>

#include "codec/choice/rate_control_enc.h"

namespace htvm::internal {

// Bits of a frame that cost so much, at another quality; P-frames cost the same at any.
double bits_at(const FrameCost& cost, double quality, double slope);

// One quality for all frames, the one that spends bits_per_second over the sequence; where that would overfill the
// buffer, a lower one from where the buffer was last empty to the overflow, and more for the rest. slope: of log2(bits)
// over quality. Expected bits fill the buffer to nine tenths at most, if lowest_quality allows.
std::vector<double> plan_qualities(std::span<const FrameCost> costs, const RateControlOptions& options, double slope);

}  // namespace htvm::internal
