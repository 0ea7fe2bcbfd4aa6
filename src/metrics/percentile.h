// Percentiles by nearest rank.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace htvm {

// The least value that at least so many percent of the values do not exceed. ascending: not empty. percent: 0..100.
inline double percentile(std::span<const double> ascending, std::size_t percent) {
    const std::size_t rank = (ascending.size() * percent + 99) / 100;
    return ascending[std::max<std::size_t>(rank, 1) - 1];
}

}  // namespace htvm
