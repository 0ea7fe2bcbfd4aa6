// The coding of one prediction residual: a whole number of either sign, under two contexts at once. The probability of
// each binary decision is the mean of the two contexts' probabilities, and both adapt: many fine contexts can be tried
// without waiting for each to learn.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "entropy/models.h"
#include "entropy/range_decoder.h"

namespace htvm::internal {

inline constexpr int residual_bits = 30;  // |residual| < 2^30

// One context's share: whether zero, the sign, and the position of the magnitude's top bit in unary.
struct ResidualContext {
    BinaryModel zero, negative;
    std::array<BinaryModel, residual_bits> top;
};

// The bits of a magnitude below its top bit: two are modelled, the others are sent as they are.
struct ResidualMantissa {
    std::array<std::array<BinaryModel, 4>, residual_bits> node;
};

namespace residual_detail {

inline BinaryModel mean(const BinaryModel& a, const BinaryModel& b) {
    return {.one = static_cast<std::uint16_t>((std::uint32_t{a.one} + b.one) / 2), .seen = 0};
}

template <class Writer>
void put(Writer& writer, BinaryModel& a, BinaryModel& b, bool bit) {
    BinaryModel both = mean(a, b);
    writer.bit(both, bit);
    a.update(bit);
    b.update(bit);
}

inline bool get(RangeDecoder& decoder, BinaryModel& a, BinaryModel& b) {
    BinaryModel both = mean(a, b);
    const bool bit = decoder.bit(both);
    a.update(bit);
    b.update(bit);
    return bit;
}

}  // namespace residual_detail

// |value| < 2^residual_bits. a and b must be two different contexts.
template <class Writer>
void encode_residual(Writer& writer, ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa,
                     std::int32_t value) {
    using residual_detail::put;
    put(writer, a.zero, b.zero, value == 0);
    if (value == 0) return;
    put(writer, a.negative, b.negative, value < 0);
    const auto magnitude = static_cast<std::uint32_t>(value < 0 ? -value : value);
    const int top = static_cast<int>(std::bit_width(magnitude)) - 1;
    for (int i = 0; i < residual_bits - 1; ++i) {
        const auto at = static_cast<std::size_t>(i);
        put(writer, a.top[at], b.top[at], i < top);
        if (i >= top) break;
    }
    std::uint32_t node = 1;
    int left = top;
    for (; left > 0 && left > top - 2; --left) {
        const bool bit = (magnitude >> (left - 1)) & 1;
        writer.bit(mantissa.node[static_cast<std::size_t>(top)][node], bit);
        node = node * 2 + bit;
    }
    if (left > 0) writer.raw(magnitude & ((1u << left) - 1), left);
}

// The counterpart; what a corrupt stream gives is also below 2^residual_bits.
inline std::int32_t decode_residual(RangeDecoder& decoder, ResidualContext& a, ResidualContext& b,
                                    ResidualMantissa& mantissa) {
    using residual_detail::get;
    if (get(decoder, a.zero, b.zero)) return 0;
    const bool negative = get(decoder, a.negative, b.negative);
    int top = 0;
    while (top < residual_bits - 1 &&
           get(decoder, a.top[static_cast<std::size_t>(top)], b.top[static_cast<std::size_t>(top)]))
        ++top;
    std::uint32_t magnitude = 1, node = 1;
    int left = top;
    for (; left > 0 && left > top - 2; --left) {
        const bool bit = decoder.bit(mantissa.node[static_cast<std::size_t>(top)][node]);
        node = node * 2 + bit;
        magnitude = magnitude * 2 + bit;
    }
    if (left > 0) magnitude = (magnitude << left) | decoder.raw(left);
    return negative ? -static_cast<std::int32_t>(magnitude) : static_cast<std::int32_t>(magnitude);
}

}  // namespace htvm::internal
