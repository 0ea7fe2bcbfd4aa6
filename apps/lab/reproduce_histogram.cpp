#include "reproduce_histogram.h"

#include <algorithm>
#include <cmath>

namespace htvm::lab {

Histogram histogram(std::span<const double> values, int most_bars, double least_width) {
    std::vector<double> finite;
    for (const double value : values)
        if (std::isfinite(value)) finite.push_back(value);
    Histogram out;
    if (finite.empty()) return out;
    const auto [low, high] = std::minmax_element(finite.begin(), finite.end());
    const double largest = std::max(std::abs(*low), std::abs(*high));
    // Values that differ by less than a thousandth of their size are one bar of a hundredth of it.
    double rough = (*high - *low) / std::max(most_bars, 1);
    if (rough <= 1e-3 * largest / std::max(most_bars, 1)) rough = largest > 0 ? 1e-2 * largest : 1;
    rough = std::max(rough, least_width);
    const double power = std::pow(10, std::floor(std::log10(rough)));
    out.width = 10 * power;
    for (const double factor : {5.0, 2.0, 1.0})
        if (factor * power >= rough * (1 - 1e-9)) out.width = factor * power;
    const double first = std::floor(*low / out.width + 1e-9);
    out.low = first * out.width;
    for (const double value : finite) {
        const auto bar = static_cast<std::size_t>(std::max(0.0, std::floor(value / out.width + 1e-9) - first));
        if (bar >= out.counts.size()) out.counts.resize(bar + 1, 0);
        ++out.counts[bar];
        out.mean += value / static_cast<double>(finite.size());
    }
    return out;
}

}  // namespace htvm::lab
