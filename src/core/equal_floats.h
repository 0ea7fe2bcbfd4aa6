// Values of several floats, such as places, of which equal ones are found by a table.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
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
    FloatsTable<N> first;
    first.reserve(values.size());
    std::vector<std::uint32_t> out;
    out.reserve(values.size());
    for (const auto& value : values)
        out.push_back(first.emplace(value, static_cast<std::uint32_t>(out.size())).first->second);
    return out;
}

}  // namespace htvm::internal
