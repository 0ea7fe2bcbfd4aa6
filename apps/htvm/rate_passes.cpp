#include "rate_passes.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace htvm::app {
namespace {

// A frame whose quality lies a share of the way from one pass's to the other's; bits grow exponentially with quality.
FrameCost between(const FrameCost& low, const FrameCost& high, double share) {
    FrameCost out = share < 0.5 ? low : high;
    if (!(low.bits > 0) || !(high.bits > 0)) return out;
    out.quality = low.quality + share * (high.quality - low.quality);
    out.bits = low.bits * std::pow(high.bits / low.bits, share);
    return out;
}

std::vector<FrameCost> between(const std::vector<FrameCost>& low, const std::vector<FrameCost>& high, double share) {
    std::vector<FrameCost> out;
    for (std::size_t i = 0; i < low.size(); ++i) out.push_back(between(low[i], high[i], share));
    return out;
}

double bits_of(const std::vector<FrameCost>& costs) {
    double bits = 0;
    for (const auto& cost : costs) bits += cost.bits;
    return bits;
}

}  // namespace

void RatePasses::add(std::vector<FrameCost> costs) {
    const double bits = bits_of(costs);
    passes_.push_back({std::move(costs), bits});
}

const RatePasses::Pass* RatePasses::nearest(bool above) const {
    const Pass* out = nullptr;
    for (const auto& pass : passes_) {
        if ((pass.bits > wanted_bits_) != above) continue;
        if (!out || std::abs(pass.bits - wanted_bits_) < std::abs(out->bits - wanted_bits_)) out = &pass;
    }
    return out;
}

std::vector<FrameCost> RatePasses::expected() const {
    const auto *low = nearest(false), *high = nearest(true);
    if (!low || !high || low->costs.size() != high->costs.size()) return passes_.back().costs;
    double least = 0, most = 1;
    for (int i = 0; i < 30; ++i) {
        const double middle = (least + most) / 2;
        (bits_of(between(low->costs, high->costs, middle)) > wanted_bits_ ? most : least) = middle;
    }
    return between(low->costs, high->costs, least);
}

}  // namespace htvm::app
