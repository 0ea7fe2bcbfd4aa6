// Codes one prediction residual, a signed whole number, under two contexts at once. The probability of each binary
// decision is the mean of both contexts' probabilities, and both adapt: a coarse context that learns fast steadies a
// fine one that has seen little. A mean rather than logistic mixing (entropy/mixing.h), because it is faster and
// residuals are most of an I-frame's decisions.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "entropy/models.h"

namespace htvm::internal {

inline constexpr std::size_t residual_bits = 30;  // |residual| < 2^30

// The models of one context: whether zero, the sign, and the position of the magnitude's top bit in unary.
struct ResidualContext {
    BinaryModel zero, negative;
    std::array<BinaryModel, residual_bits> top;
};

// The bits of a magnitude below its top bit: two are modelled, the rest sent as they are.
struct ResidualMantissa {
    std::array<std::array<BinaryModel, 4>, residual_bits> node;
};

template <class Coder>
bool code_by_both(Coder& coder, BinaryModel& a, BinaryModel& b, bool wanted) {
    BinaryModel mean{.one = static_cast<std::uint16_t>((std::uint32_t{a.one} + b.one) / 2), .seen = 0};
    const bool bit = coder.bit(mean, wanted);
    a.update(bit);
    b.update(bit);
    return bit;
}

// Writes the wanted residual and returns it, or returns the one it reads (models.h). |wanted| < 2^residual_bits; a
// corrupt stream gives no larger residuals either. a and b must be two different contexts.
template <class Coder>
std::int32_t code_residual(Coder& coder, ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa,
                           std::int32_t wanted) {
    if (code_by_both(coder, a.zero, b.zero, wanted == 0)) return 0;
    const bool negative = code_by_both(coder, a.negative, b.negative, wanted < 0);
    const auto wanted_magnitude = static_cast<std::uint32_t>(wanted < 0 ? -wanted : wanted);
    const auto wanted_width = static_cast<std::size_t>(std::bit_width(wanted_magnitude));
    std::size_t top = 0;
    while (top < residual_bits - 1 && code_by_both(coder, a.top[top], b.top[top], top + 1 < wanted_width)) ++top;
    std::uint32_t magnitude = 1;  // the bits so far; also the node in the mantissa's tree
    int left = static_cast<int>(top);
    for (; left > 0 && left > static_cast<int>(top) - 2; --left)
        magnitude = magnitude * 2 + coder.bit(mantissa.node[top][magnitude], (wanted_magnitude >> (left - 1)) & 1);
    if (left > 0) magnitude = (magnitude << left) | coder.raw(wanted_magnitude & ((1u << left) - 1), left);
    return negative ? -static_cast<std::int32_t>(magnitude) : static_cast<std::int32_t>(magnitude);
}

}  // namespace htvm::internal
