// The arithmetic coder under every layer: a byte-wise range coder with carry, after Martin (1979), in integers
// throughout.
//
// Both sides keep a range of 32 bits. Each decision cuts it in proportion to the model's probability, and a byte is
// shifted out or in whenever the range falls below 2^24. Encoder and decoder stand side by side here, since each step
// of one mirrors a step of the other. It codes decisions rather than symbols, because a binary model adapts in a few
// instructions and several can be mixed (mixing.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"

namespace htvm::internal {

// Below this a range has used up more than half of the byte that is shifted out or in next.
inline constexpr std::uint32_t half_a_byte = 1u << 28;

class RangeEncoder {
public:
    void bit(BinaryModel& model, bool bit);
    void raw(std::uint32_t value, int n);
    // Flushes and returns the bytes; the encoder cannot be used afterwards. Without any decision there are no bytes.
    std::vector<std::uint8_t> finish();
    // Where in the run the decisions so far end, in bytes, to the nearest: so that the parts of a run can be told from
    // each other. The decoder says the same after the same decisions.
    std::size_t position() const {
        return bytes_.size() + static_cast<std::size_t>(pending_ones_) + (started_ ? 1 : 0) + (range_ < half_a_byte);
    }

private:
    void shift_low();
    std::uint64_t low_ = 0;
    std::uint32_t range_ = 0xFFFFFFFFu;
    std::uint8_t pending_ = 0;        // the last byte, which a carry may still change
    std::uint64_t pending_ones_ = 0;  // number of 0xFF bytes that wait behind it
    bool started_ = false;
    bool used_ = false;
    std::vector<std::uint8_t> bytes_;
};

inline void RangeEncoder::bit(BinaryModel& model, bool bit) {
    const std::uint32_t bound = (range_ >> 16) * model.one;
    if (bit) {
        range_ = bound;
    } else {
        low_ += bound;
        range_ -= bound;
    }
    model.update(bit);
    used_ = true;
    while (range_ < (1u << 24)) {
        range_ <<= 8;
        shift_low();
    }
}

// Reads zeros past the end of the data. A complete stream never needs more than four of them. exhausted() says that
// more were read; loops that decode many symbols check it to stop early.
class RangeDecoder {
public:
    explicit RangeDecoder(std::span<const std::uint8_t> data) : data_(data) {
        for (int i = 0; i < 4; ++i) code_ = (code_ << 8) | next();
    }
    bool bit(BinaryModel& model) {
        const std::uint32_t bound = (range_ >> 16) * model.one;
        const bool bit = code_ < bound;
        if (bit) {
            range_ = bound;
        } else {
            code_ -= bound;
            range_ -= bound;
        }
        model.update(bit);
        normalise();
        return bit;
    }
    std::uint32_t raw(int n) {
        std::uint32_t value = 0;
        while (n > 0) {
            const int now = n < 16 ? n : 16;
            n -= now;
            range_ >>= now;
            std::uint32_t part = code_ / range_;
            if (part >> now) part = (1u << now) - 1;  // happens only in a corrupt stream
            code_ -= part * range_;
            value = (value << now) | part;
            normalise();
        }
        return value;
    }
    bool exhausted() const { return past_end_ > allowed_past_end; }
    // Says that the run ends after so many of the bytes that were given, at most all; false if more were read already.
    bool end_at(std::size_t size) {
        if (size < position_) return false;
        data_ = data_.first(size);
        return true;
    }
    // As RangeEncoder's; beyond the data where the encoder cut zeros off.
    std::size_t position() const { return position_ + past_end_ - 4 + (range_ < half_a_byte); }

private:
    static constexpr std::size_t allowed_past_end = 4;  // the zeros that the encoder may cut off at the end
    std::uint8_t next() {
        if (position_ < data_.size()) return data_[position_++];
        ++past_end_;
        return 0;
    }
    void normalise() {
        while (range_ < (1u << 24)) {
            range_ <<= 8;
            code_ = (code_ << 8) | next();
        }
    }
    std::span<const std::uint8_t> data_;
    std::size_t position_ = 0;
    std::size_t past_end_ = 0;
    std::uint32_t range_ = 0xFFFFFFFFu;
    std::uint32_t code_ = 0;
};

}  // namespace htvm::internal
