#include <algorithm>

#include "codec/paper/codebook.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// 2^-(length / 8), over 2^30.
std::uint64_t probability_of_length(std::uint16_t length) {
    // 2^30 * 2^(-i/8) for i = 0..7, rounded.
    constexpr std::array<std::uint32_t, 8> fractions = {1073741824, 984625594, 902905651, 827968132,
                                                        759250125,  696235434, 638450708, 585461881};
    return std::max<std::uint64_t>(1, fractions[length % 8] >> (length / 8));
}

}  // namespace

SymbolModel index_model(const Codebook& codebook) {
    const auto symbols = static_cast<std::uint32_t>(codebook.lengths.size());
    auto model = SymbolModel::for_alphabet(symbols);
    const std::uint32_t leaves = 1u << model.bits();
    std::vector<std::uint64_t> mass(2 * leaves, 0);
    for (std::uint32_t i = 0; i < symbols; ++i) mass[leaves + i] = probability_of_length(codebook.lengths[i]);
    for (std::uint32_t node = leaves - 1; node >= 1; --node) {
        mass[node] = mass[2 * node] + mass[2 * node + 1];
        if (mass[node] == 0) continue;
        const std::uint64_t one = (mass[2 * node + 1] << 16) / mass[node];
        model.node(node).one = static_cast<std::uint16_t>(std::clamp<std::uint64_t>(one, 48, 65535 - 48));
        model.node(node).seen = 24;  // as sure as after two dozen decisions; 8 to 110 measure alike
    }
    return model;
}

Result<Codebook> decode_codebook(std::span<const std::uint8_t> bytes) {
    RangeDecoder decoder(bytes);
    UnsignedModel step_model, length_model;
    std::array<SignedModel, 3> component_models;
    Codebook out;
    const std::uint32_t size = decoder.raw(12);
    const std::uint32_t escape_step = decode_unsigned(decoder, step_model);
    const std::uint32_t scale = decode_unsigned(decoder, step_model) + 1;
    if (size > max_codewords || escape_step >= (1u << 24) || scale > (1u << 26))
        return fail(ErrorKind::corrupt_stream, "codebook: its size or steps are out of range");
    out.escape_step = static_cast<std::int32_t>(escape_step) + 1;
    std::uint32_t length = 0;
    for (std::uint32_t i = 0; i < size; ++i) {
        ResidualVector codeword{};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int64_t v = std::int64_t{decode_signed(decoder, component_models[c])} * scale;
            if (v > (1 << 26) || v < -(1 << 26))
                return fail(ErrorKind::corrupt_stream, "codebook: a codeword is out of range");
            codeword[c] = static_cast<std::int32_t>(v);
        }
        out.codewords.push_back(codeword);
        length += decode_unsigned(decoder, length_model);
        if (length > max_length || decoder.exhausted())
            return fail(ErrorKind::corrupt_stream, "codebook: it ends too early, or a code length is out of range");
        out.lengths.push_back(static_cast<std::uint16_t>(length));
    }
    const std::uint32_t escape_length = decoder.raw(8);
    if (escape_length > max_length || decoder.exhausted())
        return fail(ErrorKind::corrupt_stream, "codebook: it ends too early, or a code length is out of range");
    out.lengths.push_back(static_cast<std::uint16_t>(escape_length));
    return out;
}

}  // namespace htvm::internal
