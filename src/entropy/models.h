// Adaptive models of the symbol streams, and how a symbol is cut into binary decisions.
//
// Every symbol is coded as binary decisions, each with its own adaptive probability: a small, fast and exact adaptive
// arithmetic coder. The functions that encode a symbol are templates over a Writer with
//     void bit(BinaryModel&, bool)          one decision under a model, which adapts
//     void raw(std::uint32_t value, int n)  the n low bits of value, equally likely, n <= 32
// There are two: RangeEncoder (bytes) and CostCounter (counts the bits, without writing anything).
// Decoding has the same shape with a Reader, the RangeDecoder:
//     bool bit(BinaryModel&)
//     std::uint32_t raw(int n)
//
// A layer whose syntax is full of cases is better written once for both directions: a function that codes a value
// takes a coder and the value that is wanted. With a WritingCoder it writes that value and returns it; with a
// ReadingCoder it ignores what is wanted and returns what it reads. What both sides derive from the value then cannot
// differ.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace htvm::internal {

// The probability that the next decision is 1, in units of 1/65536. The n-th decision adapts it by 1/(n + 1.5), but
// never by less than 1/128: it learns a stationary source as fast as counting does, and follows one that drifts.
struct BinaryModel {
    std::uint16_t one = 32768;
    std::uint16_t seen = 0;  // not a byte: a compiler must assume that those may be a part of anything else

    void update(bool bit);
};

inline constexpr std::uint16_t model_seen_limit = 127;

// 65536 / (n + 1.5) for n = 0 .. model_seen_limit.
inline constexpr auto model_rates = [] {
    std::array<std::uint16_t, model_seen_limit + 1> rates{};
    for (std::uint32_t n = 0; n <= model_seen_limit; ++n) rates[n] = static_cast<std::uint16_t>(131072u / (2 * n + 3));
    return rates;
}();

// Towards 65535 or 0 by the rate's share, rounded down in either case. No product exceeds 32 bits.
inline void BinaryModel::update(bool bit) {
    const std::uint32_t now = one, rate = model_rates[seen];
    if (bit)
        one = static_cast<std::uint16_t>(std::min<std::uint32_t>(now + (((65535u - now) * rate) >> 16), 65535u - 48));
    else
        one = static_cast<std::uint16_t>(std::max<std::uint32_t>(now - ((now * rate + 65535u) >> 16), 48u));
    seen = static_cast<std::uint16_t>(seen + (seen < model_seen_limit));  // not a branch, which cannot be foreseen
}

// Symbols 0 .. 2^bits - 1 as a binary tree, most significant bit first.
class SymbolModel {
public:
    explicit SymbolModel(int bits) : bits_(bits), nodes_(std::size_t{1} << bits) {}
    // For an alphabet of `size` symbols (at least 1).
    static SymbolModel for_alphabet(std::uint32_t size) {
        return SymbolModel(static_cast<int>(std::bit_width(size > 1 ? size - 1 : 0u)));
    }
    int bits() const { return bits_; }
    BinaryModel& node(std::uint32_t index) { return nodes_[index]; }

private:
    int bits_;
    std::vector<BinaryModel> nodes_;  // node 1 is the root; node n has the children 2n and 2n + 1
};

template <class Writer>
void encode_symbol(Writer& writer, SymbolModel& model, std::uint32_t symbol) {
    std::uint32_t node = 1;
    for (int i = model.bits() - 1; i >= 0; --i) {
        const bool bit = (symbol >> i) & 1;
        writer.bit(model.node(node), bit);
        node = node * 2 + bit;
    }
}

template <class Reader>
std::uint32_t decode_symbol(Reader& reader, SymbolModel& model) {
    std::uint32_t node = 1;
    for (int i = 0; i < model.bits(); ++i) node = node * 2 + reader.bit(model.node(node));
    return node - (1u << model.bits());
}

// Whole numbers from 0 to 2^32 - 2: an adaptive exponential Golomb code. u + 1 = 2^k + m: first k in unary, then the k
// bits of m, of which the top three are adaptive. Values up to 14 thus have a fully adaptive distribution.
struct UnsignedModel {
    std::array<BinaryModel, 33> prefix;
    std::array<std::array<BinaryModel, 8>, 33> mantissa;
};

template <class Writer>
void encode_unsigned(Writer& writer, UnsignedModel& model, std::uint32_t value) {
    const std::uint64_t shifted = std::uint64_t{value} + 1;
    const int k = static_cast<int>(std::bit_width(shifted)) - 1;
    for (int i = 0; i < k; ++i) writer.bit(model.prefix[static_cast<std::size_t>(i)], true);
    if (k < 32) writer.bit(model.prefix[static_cast<std::size_t>(k)], false);
    std::uint32_t node = 1;
    int left = k;
    for (; left > 0 && left > k - 3; --left) {
        const bool bit = (shifted >> (left - 1)) & 1;
        writer.bit(model.mantissa[static_cast<std::size_t>(k)][node], bit);
        node = node * 2 + bit;
    }
    if (left > 0) writer.raw(static_cast<std::uint32_t>(shifted & ((std::uint64_t{1} << left) - 1)), left);
}

template <class Reader>
std::uint32_t decode_unsigned(Reader& reader, UnsignedModel& model) {
    int k = 0;
    while (k < 32 && reader.bit(model.prefix[static_cast<std::size_t>(k)])) ++k;
    std::uint64_t shifted = 1;
    std::uint32_t node = 1;
    int left = k;
    for (; left > 0 && left > k - 3; --left) {
        const bool bit = reader.bit(model.mantissa[static_cast<std::size_t>(k)][node]);
        node = node * 2 + bit;
        shifted = shifted * 2 + bit;
    }
    if (left > 0) shifted = (shifted << left) | reader.raw(left);
    return static_cast<std::uint32_t>(shifted - 1);  // in a corrupt stream k = 32 wraps around, which is harmless
}

// Signed whole numbers, |v| <= 2^31 - 1: whether v is zero, its sign, then |v| - 1.
struct SignedModel {
    BinaryModel zero;
    BinaryModel negative;
    UnsignedModel magnitude;
};

template <class Writer>
void encode_signed(Writer& writer, SignedModel& model, std::int32_t value) {
    writer.bit(model.zero, value == 0);
    if (value == 0) return;
    writer.bit(model.negative, value < 0);
    encode_unsigned(writer, model.magnitude, static_cast<std::uint32_t>(value < 0 ? -value : value) - 1);
}

template <class Reader>
std::int32_t decode_signed(Reader& reader, SignedModel& model) {
    if (reader.bit(model.zero)) return 0;
    const bool negative = reader.bit(model.negative);
    const std::uint32_t magnitude = (decode_unsigned(reader, model.magnitude) & 0x7FFFFFFFu) + 1u;
    const std::uint32_t clamped = magnitude > 0x7FFFFFFFu ? 0x7FFFFFFFu : magnitude;
    return negative ? -static_cast<std::int32_t>(clamped) : static_cast<std::int32_t>(clamped);
}

template <class Writer>
struct WritingCoder {
    static constexpr bool writes = true;
    Writer& writer;
    bool bit(BinaryModel& model, bool wanted) {
        writer.bit(model, wanted);
        return wanted;
    }
    std::uint32_t raw(std::uint32_t wanted, int n) {
        writer.raw(wanted, n);
        return wanted;
    }
    std::uint32_t number(UnsignedModel& model, std::uint32_t wanted) {
        encode_unsigned(writer, model, wanted);
        return wanted;
    }
    std::int32_t signed_number(SignedModel& model, std::int32_t wanted) {
        encode_signed(writer, model, wanted);
        return wanted;
    }
};

template <class Reader>
struct ReadingCoder {
    static constexpr bool writes = false;
    Reader& reader;
    bool bit(BinaryModel& model, bool) { return reader.bit(model); }
    std::uint32_t raw(std::uint32_t, int n) { return reader.raw(n); }
    std::uint32_t number(UnsignedModel& model, std::uint32_t) { return decode_unsigned(reader, model); }
    std::int32_t signed_number(SignedModel& model, std::int32_t) { return decode_signed(reader, model); }
};

}  // namespace htvm::internal
