// Values of several floats, such as places, of which equal ones are found by a table.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

namespace htvm::internal {

// The two zeros, which are equal, have the same.
struct FloatsHash {
    template <std::size_t N>
    std::size_t operator()(const std::array<float, N>& value) const {
        std::uint64_t h = 0;
        for (const float c : value)
            h = std::rotl((h ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0x9e3779b97f4a7c15u, 29);
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

template <std::size_t N>
using FloatsTable = std::unordered_map<std::array<float, N>, std::uint32_t, FloatsHash>;

// For each value, the index of the first that equals it.
template <std::size_t N>
std::vector<std::uint32_t> first_equal(std::span<const std::array<float, N>> values) {
    constexpr auto none = std::numeric_limits<std::uint32_t>::max();
    const std::size_t slots = std::bit_ceil(2 * values.size() + 2);
    std::vector<std::uint32_t> table(slots, none), out(values.size());
    for (std::uint32_t i = 0; i < values.size(); ++i) {
        std::size_t slot = FloatsHash()(values[i]) & (slots - 1);
        while (table[slot] != none && values[table[slot]] != values[i]) slot = (slot + 1) & (slots - 1);
        if (table[slot] == none) table[slot] = i;
        out[i] = table[slot];
    }
    return out;
}

}  // namespace htvm::internal
