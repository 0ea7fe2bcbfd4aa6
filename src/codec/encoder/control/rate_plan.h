// The plan for a second pass: a quality for every frame of a sequence whose sizes are known from a first pass.
#pragma once

#include <span>
#include <vector>

#include "codec/encoder/control/rate_control.h"

namespace htvm::internal {

// The bits of a frame at another quality; those of a P-frame do not depend on it.
double bits_at(const FrameCost& cost, double quality, double slope);

// One quality for all frames, at which the sequence spends bits_per_second. If that would overfill the buffer, the
// frames from where the buffer was last empty up to the overflow get a lower quality, and the rest a higher one. slope:
// change of log2(bits) per unit of quality. Expected bits fill the buffer to at most nine tenths, if lowest_quality
// allows it.
std::vector<double> plan_qualities(std::span<const FrameCost> costs, const RateControlOptions& options, double slope);

}  // namespace htvm::internal
