#include "codec/encoder/control/error_control.h"

#include <algorithm>
#include <cmath>

#include "htvm/encoder.hpp"

namespace htvm::internal {

double ErrorController::quality(FrameType type) const {
    // step(q) = step(0) * 2^(-6 q / 100), error = step * 2^ratio.
    const double log_step = std::log2(target_) - log_ratio_[static_cast<std::size_t>(type)];
    return std::clamp((std::log2(quality_steps(0).geometry_step) - log_step) * 100 / 6, 0.0, 100.0);
}

bool ErrorController::accept(FrameType type, double quality, double error) {
    constexpr double tolerance = 0.04;  // log2 of 3 %
    if (!(error > 0) || !std::isfinite(error)) return true;
    auto& ratio = log_ratio_[static_cast<std::size_t>(type)];
    ratio = std::log2(error) - std::log2(quality_steps(quality).geometry_step);
    const double off = std::log2(error / target_);
    const bool at_an_end = (off > 0 && quality >= 100) || (off < 0 && quality <= 0);
    return std::abs(off) <= tolerance || at_an_end;
}

}  // namespace htvm::internal
