// Pixels of which each channel is some bits of a little-endian number, as in BMP and DDS.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace htvm::internal {

// A number of `count` bytes at that place, all of which must be there; count: 1 to 4.
inline std::uint32_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
    std::uint32_t out = 0;
    for (std::size_t i = 0; i < count; ++i) out |= std::uint32_t{bytes[at + i]} << (8 * i);
    return out;
}

// What the mask takes of a pixel, as 0..255: of fewer bits than 8 the largest value is 255. 0 without a mask.
inline std::uint8_t masked_level(std::uint32_t pixel, std::uint32_t mask) {
    if (mask == 0) return 0;
    const int begin = std::countr_zero(mask);
    const std::uint64_t most = mask >> begin, value = (pixel & mask) >> begin;
    return static_cast<std::uint8_t>((value * 255 + most / 2) / most);
}

}  // namespace htvm::internal
