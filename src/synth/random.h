// Random numbers that depend on their key alone, so that any frame can be generated on its own, in any order and on any
// number of threads.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace htvm::synth {

// A key for a stream of random numbers; every number of the stream is a pure function of the key and its index.
struct RandomKey {
    std::uint64_t value = 0;
};

// The finaliser of splitmix64: a bijection in which every input bit changes every output bit.
inline std::uint64_t mix_bits(std::uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9ull;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

inline RandomKey derive_key(RandomKey key, std::uint64_t branch) {
    return {mix_bits(key.value + 0x9e3779b97f4a7c15ull * (branch + 1))};
}

inline std::uint64_t random_bits(RandomKey key, std::uint64_t index) {
    return mix_bits(key.value ^ mix_bits(0x9e3779b97f4a7c15ull * (index + 1)));
}

// Uniform in [0, 1).
inline double random_uniform(RandomKey key, std::uint64_t index) {
    return static_cast<double>(random_bits(key, index) >> 11) * 0x1p-53;
}

// Normal with mean 0 and variance 1 (Box-Muller).
inline double random_gaussian(RandomKey key, std::uint64_t index) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - random_uniform(key, 2 * index)));
    return radius * std::cos(2.0 * std::numbers::pi * random_uniform(key, 2 * index + 1));
}

}  // namespace htvm::synth
