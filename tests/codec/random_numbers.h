// Whole numbers from a generator, the same with every standard library.
#pragma once

#include <cstdint>
#include <random>

namespace htvm::test {

// 0 .. n - 1.
inline std::uint32_t below(std::mt19937& random, std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); }

// low .. high.
inline std::int32_t between(std::mt19937& random, std::int32_t low, std::int32_t high) {
    const auto range = static_cast<std::uint64_t>(std::int64_t{high} - low + 1);
    return static_cast<std::int32_t>(low + static_cast<std::int64_t>(random() % range));
}

}  // namespace htvm::test
