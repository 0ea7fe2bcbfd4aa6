// Percentiles by nearest rank, and the middle of values in any order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace htvm {

// The least value that at least so many percent of the values do not exceed. ascending: not empty. percent: 0..100.
inline double percentile(std::span<const double> ascending, std::size_t percent) {
    const std::size_t rank = (ascending.size() * percent + 99) / 100;
    return ascending[std::max<std::size_t>(rank, 1) - 1];
}

// The upper one of the two in the middle of an even number; 0 without values.
template <class Value>
Value middle_of(std::vector<Value> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace htvm
