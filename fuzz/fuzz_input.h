// Takes numbers and choices from the front of a fuzzing input. Past the end everything is zero, so that every input has
// a meaning, and a short one a simple meaning.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <span>
#include <vector>

namespace htvm::fuzz {

class FuzzInput {
public:
    FuzzInput(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}
    std::uint8_t u8() { return static_cast<std::uint8_t>(get(1)); }
    std::uint16_t u16() { return static_cast<std::uint16_t>(get(2)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(get(4)); }
    std::uint64_t u64() { return get(8); }
    bool flag() { return (u8() & 1) != 0; }
    // 0 .. n - 1, from one byte if that is enough; n is at least 1.
    std::uint32_t below(std::uint32_t n) { return (n <= 256 ? u8() : n <= 65536 ? u16() : u32()) % n; }
    // low .. high.
    std::int32_t between(std::int32_t low, std::int32_t high) {
        const auto range = static_cast<std::uint64_t>(std::int64_t{high} - low + 1);
        const std::uint64_t taken = range <= 256 ? u8() : range <= 65536 ? u16() : u32();
        return static_cast<std::int32_t>(low + static_cast<std::int64_t>(taken % range));
    }
    // Any float, including NaN, infinity and denormal ones.
    float any_float() { return std::bit_cast<float>(u32()); }
    // A signed whole number, most often a small one; |.| <= limit.
    std::int32_t number(std::int32_t limit) {
        const std::uint8_t shape = u8();
        if (shape < 160) return between(-(limit < 100 ? limit : 100), limit < 100 ? limit : 100);
        if (shape < 240) return between(-(limit < 30000 ? limit : 30000), limit < 30000 ? limit : 30000);
        return between(-limit, limit);
    }
    std::span<const std::uint8_t> take(std::size_t n) {
        const auto out = bytes_.first(n < bytes_.size() ? n : bytes_.size());
        bytes_ = bytes_.subspan(out.size());
        return out;
    }
    std::span<const std::uint8_t> rest() { return take(bytes_.size()); }
    std::size_t left() const { return bytes_.size(); }

private:
    std::uint64_t get(std::size_t n) {
        const auto taken = take(n);
        std::uint64_t out = 0;
        for (std::size_t i = 0; i < taken.size(); ++i) out |= std::uint64_t{taken[i]} << (8 * i);
        return out;
    }
    std::span<const std::uint8_t> bytes_;
};

// Ends the program, as a sanitizer does, if something that must hold does not.
inline void require(bool fact, const char* what) {
    if (fact) return;
    std::cerr << "fuzzing: this must hold and does not: " << what << std::endl;
    std::abort();
}

// A layer's bytes damaged as the input says: flipped, overwritten, truncated or extended.
inline std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, FuzzInput& input) {
    for (std::uint32_t n = input.below(8); n > 0; --n) {
        const std::uint8_t kind = input.u8();
        if (kind >= 250) bytes.push_back(input.u8());
        if (bytes.empty()) continue;
        const std::size_t at = input.below(static_cast<std::uint32_t>(bytes.size()));
        if (kind < 120)
            bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << (kind % 8)));
        else if (kind < 200)
            bytes[at] = input.u8();
        else if (kind < 220)
            bytes.resize(at);
        else if (kind < 250)
            bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at));
    }
    return bytes;
}

}  // namespace htvm::fuzz
