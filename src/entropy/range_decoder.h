// The arithmetic decoder, and the decoding side of the symbol models in models.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "entropy/models.h"

namespace htvm::internal {

// Reads zeros past the end of the data. A stream that was not cut short never needs more than four of them:
// exhausted() says that more were read, and a loop that decodes many symbols checks it to stop early.
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
            if (part >> now) part = (1u << now) - 1;  // only in a corrupt stream
            code_ -= part * range_;
            value = (value << now) | part;
            normalise();
        }
        return value;
    }
    bool exhausted() const { return past_end_ > allowed_past_end; }

private:
    static constexpr std::size_t allowed_past_end = 4;  // the zeros that the encoder may cut off its end
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

inline std::uint32_t decode_symbol(RangeDecoder& decoder, SymbolModel& model) {
    std::uint32_t node = 1;
    for (int i = 0; i < model.bits(); ++i) node = node * 2 + decoder.bit(model.node(node));
    return node - (1u << model.bits());
}

inline std::uint32_t decode_unsigned(RangeDecoder& decoder, UnsignedModel& model) {
    int k = 0;
    while (k < 32 && decoder.bit(model.prefix[static_cast<std::size_t>(k)])) ++k;
    std::uint64_t shifted = 1;
    std::uint32_t node = 1;
    int left = k;
    for (; left > 0 && left > k - 3; --left) {
        const bool bit = decoder.bit(model.mantissa[static_cast<std::size_t>(k)][node]);
        node = node * 2 + bit;
        shifted = shifted * 2 + bit;
    }
    if (left > 0) shifted = (shifted << left) | decoder.raw(left);
    return static_cast<std::uint32_t>(shifted - 1);  // k = 32 in a corrupt stream wraps, which is harmless
}

inline std::int32_t decode_signed(RangeDecoder& decoder, SignedModel& model) {
    if (decoder.bit(model.zero)) return 0;
    const bool negative = decoder.bit(model.negative);
    const std::uint32_t magnitude = (decode_unsigned(decoder, model.magnitude) & 0x7FFFFFFFu) + 1u;
    const std::uint32_t clamped = magnitude > 0x7FFFFFFFu ? 0x7FFFFFFFu : magnitude;
    return negative ? -static_cast<std::int32_t>(clamped) : static_cast<std::int32_t>(clamped);
}

}  // namespace htvm::internal
