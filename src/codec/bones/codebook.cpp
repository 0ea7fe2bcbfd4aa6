#include "codec/bones/codebook.h"

#include <algorithm>
#include <numeric>

#include "core/bytes.h"
#include "core/lattice.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// 2^-(length / 8), in units of 2^-30.
std::uint64_t probability_of_length(std::uint16_t length) {
    // 2^30 * 2^(-i/8) for i = 0..7, rounded.
    constexpr std::array<std::uint32_t, 8> fractions = {1073741824, 984625594, 902905651, 827968132,
                                                        759250125,  696235434, 638450708, 585461881};
    return std::max<std::uint64_t>(1, fractions[length % 8] >> (length / 8));
}

}  // namespace

// The code lengths tell how often each index is expected. Used as starting probabilities, they make a separate table
// unnecessary, and a codebook kept from an earlier frame still adapts to this one.
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
        model.node(node).seen = 24;  // as confident as after about 24 decisions; values from 8 to 110 measure the same
    }
    return model;
}

std::vector<std::uint8_t> encode_codebook(const Codebook& codebook) {
    // Codewords are sent divided by their greatest common divisor, since the encoder may have rounded them to a coarser
    // grid.
    std::int32_t scale = 0;
    for (const auto& codeword : codebook.codewords)
        for (const auto c : codeword) scale = std::gcd(scale, c);
    if (scale == 0) scale = 1;
    RangeEncoder encoder;
    UnsignedModel step_model, length_model;
    std::array<SignedModel, 3> component_models;
    encoder.raw(static_cast<std::uint32_t>(codebook.codewords.size()), 12);
    encode_unsigned(encoder, step_model, static_cast<std::uint32_t>(codebook.escape_step - 1));
    encode_unsigned(encoder, step_model, static_cast<std::uint32_t>(scale - 1));
    std::uint16_t previous = 0;
    for (std::size_t i = 0; i < codebook.codewords.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c)
            encode_signed(encoder, component_models[c], codebook.codewords[i][c] / scale);
        encode_unsigned(encoder, length_model, static_cast<std::uint32_t>(codebook.lengths[i] - previous));
        previous = codebook.lengths[i];
    }
    encoder.raw(codebook.lengths.back(), 8);
    return encoder.finish();
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

std::vector<std::uint8_t> write_codebook_payload(std::uint8_t purpose, std::uint32_t number, const Codebook& codebook) {
    ByteWriter out;
    out.u8(purpose);
    out.varint(number);
    out.bytes(encode_codebook(codebook));
    return out.take();
}

Result<NumberedCodebook> read_codebook_payload(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    NumberedCodebook out;
    out.purpose = in.u8();
    const std::uint64_t number = in.varint();
    if (!in.ok() || out.purpose > codebook_for_colour || number > 0x7FFFFFFF)
        return fail(ErrorKind::corrupt_stream, "codebook: its purpose or number is out of range");
    out.number = static_cast<std::uint32_t>(number);
    auto codebook = decode_codebook(in.bytes(in.remaining()));
    if (!codebook) return tl::unexpected(codebook.error());
    out.codebook = std::move(*codebook);
    return out;
}

std::vector<std::uint8_t> encode_residuals(const QuantisedResiduals& residuals, const Codebook& codebook) {
    RangeEncoder encoder;
    auto model = index_model(codebook);
    std::array<SignedModel, 3> escape_models;
    for (std::size_t k = 0; k < residuals.indices.size(); ++k) {
        encode_symbol(encoder, model, residuals.indices[k]);
        if (residuals.indices[k] < codebook.codewords.size()) continue;
        for (std::size_t c = 0; c < 3; ++c)
            encode_signed(encoder, escape_models[c], residuals.values[k][c] / codebook.escape_step);
    }
    return encoder.finish();
}

Result<std::vector<ResidualVector>> decode_residuals(std::span<const std::uint8_t> bytes, std::size_t count,
                                                     const Codebook& codebook) {
    RangeDecoder decoder(bytes);
    auto model = index_model(codebook);
    std::array<SignedModel, 3> escape_models;
    std::vector<ResidualVector> out;
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t index = decode_symbol(decoder, model);
        if (index > codebook.codewords.size())
            return fail(ErrorKind::corrupt_stream, "residual layer: an index is outside the codebook");
        ResidualVector value{};
        if (index < codebook.codewords.size()) {
            value = codebook.codewords[index];
        } else {
            for (std::size_t c = 0; c < 3; ++c) {
                const std::int64_t v = std::int64_t{decode_signed(decoder, escape_models[c])} * codebook.escape_step;
                if (v > 4 * lattice_limit || v < -4 * lattice_limit)
                    return fail(ErrorKind::corrupt_stream, "residual layer: a residual is out of range");
                value[c] = static_cast<std::int32_t>(v);
            }
        }
        out.push_back(value);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "residual layer: it ends too early");
    }
    return out;
}

}  // namespace htvm::internal
