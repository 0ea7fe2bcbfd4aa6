#include "codec/encoder/control/rate_plan.h"

#include <algorithm>
#include <cmath>

namespace htvm::internal {
namespace {

// The highest quality in the range of the options that fits. fits() must be monotonic: true for all qualities below one
// for which it is true.
template <class Fits>
double highest_that(const RateControlOptions& options, const Fits& fits) {
    double low = options.lowest_quality, high = options.highest_quality;
    if (fits(high)) return high;
    for (int i = 0; i < 40; ++i) {
        const double middle = (low + high) / 2;
        (fits(middle) ? low : high) = middle;
    }
    return low;
}

struct Line {
    double per_frame = 0;  // bits that the line carries in the time of a frame
    double limit = 0;      // most bits that the plan lets into the buffer
};

// Gives the free frames the one quality that spends the bits left by the others.
void share_out(std::span<const FrameCost> costs, const RateControlOptions& options, double slope, const Line& line,
               const std::vector<bool>& fixed, std::vector<double>& plan) {
    const double quality = highest_that(options, [&](double q) {
        double bits = 0;
        for (std::size_t i = 0; i < costs.size(); ++i) bits += bits_at(costs[i], fixed[i] ? plan[i] : q, slope);
        return bits <= line.per_frame * static_cast<double>(costs.size());
    });
    for (std::size_t i = 0; i < costs.size(); ++i)
        if (!fixed[i]) plan[i] = quality;
}

// A stretch of frames [begin, end) that begins with an empty buffer and ends at the peak of its first overflow.
struct Overflow {
    std::size_t begin = 0, end = 0;
};

Overflow first_overflow(std::span<const FrameCost> costs, double slope, const Line& line,
                        const std::vector<double>& plan) {
    Overflow found;
    double buffer = 0, highest = line.limit;
    for (std::size_t i = 0; i < costs.size(); ++i) {
        if (buffer <= 0) {
            if (found.end > 0) return found;
            found.begin = i;
        }
        buffer += bits_at(costs[i], plan[i], slope);
        if (buffer > highest) highest = buffer, found.end = i + 1;
        buffer = std::max(0.0, buffer - line.per_frame);
    }
    return found;
}

double peak(std::span<const FrameCost> costs, double quality, double slope, const Line& line) {
    double buffer = 0, highest = 0;
    for (const auto& cost : costs) {
        buffer += bits_at(cost, quality, slope);
        highest = std::max(highest, buffer);
        buffer = std::max(0.0, buffer - line.per_frame);
    }
    return highest;
}

}  // namespace

double bits_at(const FrameCost& cost, double quality, double slope) {
    return rules_of(cost.type).rate == RateClass::moved ? cost.bits
                                                        : cost.bits * std::exp2(slope * (quality - cost.quality));
}

std::vector<double> plan_qualities(std::span<const FrameCost> costs, const RateControlOptions& options, double slope) {
    const Line line{options.bits_per_second / options.frames_per_second,
                    0.9 * options.bits_per_second * options.buffer_seconds};
    std::vector<double> plan(costs.size(), options.lowest_quality);
    std::vector<bool> fixed(costs.size(), false);
    constexpr int most_rounds = 50;  // each round lowers one stretch and lets the rest rise
    for (int round = 0; round < most_rounds; ++round) {
        share_out(costs, options, slope, line, fixed, plan);
        for (int stretch = 0; stretch < most_rounds; ++stretch) {
            const auto [begin, end] = first_overflow(costs, slope, line, plan);
            if (end == 0) {
                if (stretch == 0) return plan;
                break;
            }
            const auto part = costs.subspan(begin, end - begin);
            const double quality =
                highest_that(options, [&](double q) { return peak(part, q, slope, line) <= line.limit * 0.999; });
            for (std::size_t i = begin; i < end; ++i) plan[i] = quality, fixed[i] = true;
        }
    }
    return plan;
}

}  // namespace htvm::internal
