// Bytes as from a hostile or damaged source.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "codec/random_numbers.h"

namespace htvm::hostile {

// Calls decode(bytes) on every prefix of the bytes (for long ones, on about 400), on many copies with a few flipped
// bits, and on pure noise. Any result of decode is right, as long as it returns.
template <class Decode>
void try_everything(const std::vector<std::uint8_t>& bytes, const Decode& decode, int flips = 400) {
    const std::size_t stride = bytes.size() / 400 + 1;
    for (std::size_t size = 0; size < bytes.size(); size += stride)
        decode(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    std::mt19937 random(static_cast<unsigned>(bytes.size()));
    for (int i = 0; i < flips; ++i) {
        auto damaged = bytes;
        if (damaged.empty()) damaged.assign(1, 0);
        for (std::uint32_t n = 1 + test::below(random, 3); n > 0; --n) {
            auto& byte = damaged[random() % damaged.size()];
            byte = static_cast<std::uint8_t>(byte ^ (1u << random() % 8));
        }
        decode(damaged);
    }
    for (int i = 0; i < flips / 4; ++i) {
        std::vector<std::uint8_t> noise(random() % 100);
        for (auto& byte : noise) byte = static_cast<std::uint8_t>(test::below(random, 4) > 0 ? random() : 255);
        decode(noise);
    }
}

}  // namespace htvm::hostile
