// The adaptive models of a vertex field's quantised differences, and the contexts that choose among them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

// What is known round a difference before it is coded. Classes, each from 0 to below its limit.
struct SplitContext {
    static constexpr std::size_t levels = 6, magnitudes = 3, activities = 12, steeps = 8, signs = 3;
    std::size_t level = 0;     // of the hierarchy, the finest is 0
    std::size_t up = 0;        // magnitude of the difference above: 0, 1, more
    std::size_t activity = 0;  // of the differences round it: those coded, and those above the ones not yet coded
    std::size_t before = 0;    // magnitude of the same difference in the frame before
    std::size_t other = 0;     // magnitude of the same difference in the component before
    std::size_t third = 0;     // and in the one before that
    std::size_t steep = 0;     // magnitude of the predicted difference over the step
    std::size_t slope = 0;     // its sign: 0 none, 1 positive, 2 negative
    std::size_t sign = 0;      // sign of the same difference in the component before
};

// Of one component.
struct SplitModels {
    template <std::size_t N>
    using Models = std::array<BinaryModel, N>;
    using C = SplitContext;

    // Whether other than zero.
    Models<C::levels * C::magnitudes * C::activities> by_level{};
    Models<C::magnitudes * C::activities> by_before{};
    Models<C::magnitudes * C::magnitudes * C::magnitudes * C::magnitudes> by_other{};
    Models<C::steeps * C::levels> by_steep{};
    std::array<Mixer<4>, C::levels> nonzero_mixer{};
    // Whether negative.
    Models<C::signs * C::steeps> by_slope{};
    Models<C::signs * C::signs> by_sign{};
    Mixer<2> sign_mixer{};
    // The magnitude less one: in unary, from `unary` on as an exponential Golomb code.
    static constexpr std::size_t unary = 6;
    std::array<Models<unary>, C::activities> more_by_activity{};
    std::array<Models<unary>, C::magnitudes * C::magnitudes> more_by_before{};
    std::array<Mixer<2>, unary> more_mixer{};
    Models<32> top{}, next{};
};

namespace split_detail {

using C = SplitContext;

inline std::array<BinaryModel*, 4> nonzero(SplitModels& m, const C& c) {
    return {&m.by_level[(c.level * C::magnitudes + c.up) * C::activities + c.activity],
            &m.by_before[c.before * C::activities + c.activity],
            &m.by_other[((c.other * C::magnitudes + c.third) * C::magnitudes + c.up) * C::magnitudes + c.before],
            &m.by_steep[c.steep * C::levels + c.level]};
}

inline std::array<BinaryModel*, 2> negative(SplitModels& m, const C& c) {
    return {&m.by_slope[c.slope * C::steeps + c.steep], &m.by_sign[c.sign * C::signs + c.slope]};
}

inline std::array<BinaryModel*, 2> more(SplitModels& m, const C& c, std::size_t i) {
    return {&m.more_by_activity[c.activity][i], &m.more_by_before[c.before * C::magnitudes + c.up][i]};
}

}  // namespace split_detail

inline constexpr std::int32_t most_split = 1 << 30;  // of a quantised difference's magnitude

// Codes one quantised difference. Coder::bit(BinaryModel&, bool) and raw(std::uint32_t, int) put what is wanted into
// the stream, or, decoding, ignore it, and return what the stream says.
template <class Coder>
std::int32_t code_split(Coder& coder, SplitModels& m, const SplitContext& c, std::int32_t wanted) {
    if (!code_mixed(coder, m.nonzero_mixer[c.level], split_detail::nonzero(m, c), wanted != 0)) return 0;
    const bool negative = code_mixed(coder, m.sign_mixer, split_detail::negative(m, c), wanted < 0);
    const auto rest = static_cast<std::uint32_t>(std::max(std::abs(wanted), 1) - 1);
    std::uint32_t coded = 0;
    while (coded < SplitModels::unary &&
           code_mixed(coder, m.more_mixer[coded], split_detail::more(m, c, coded), rest > coded))
        ++coded;
    if (coded == SplitModels::unary) {
        const std::uint32_t left = std::max(rest, coded) - coded + 1;
        const int width = static_cast<int>(std::bit_width(left)) - 1;
        int top = 0;
        while (top < 30 && coder.bit(m.top[static_cast<std::size_t>(top)], top < width)) ++top;
        std::uint32_t value = 1;
        if (top > 0) value = 2 + coder.bit(m.next[static_cast<std::size_t>(top)], (left >> std::max(width - 1, 0)) & 1);
        if (top > 1) value = (value << (top - 1)) | coder.raw(left & ((1u << (top - 1)) - 1), top - 1);
        coded += value - 1;
    }
    const auto magnitude = static_cast<std::int32_t>(std::min(coded, static_cast<std::uint32_t>(most_split) - 1)) + 1;
    return negative ? -magnitude : magnitude;
}

}  // namespace htvm::internal
