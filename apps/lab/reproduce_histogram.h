// Distributions over frames.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace htvm::lab {

struct Histogram {
    double low = 0, width = 1;          // of the first bar; of every bar
    std::vector<std::uint64_t> counts;  // one a bar; the sum is the number of values
    double mean = 0;                    // of the values themselves
};

// Bars whose width is 1, 2 or 5 times a power of ten and which start at a multiple of it, at most `most_bars` + 1 of
// them, none narrower than `least_width`; values that are not finite are left out. Equal values make one bar.
Histogram histogram(std::span<const double> values, int most_bars = 12, double least_width = 0);

}  // namespace htvm::lab
