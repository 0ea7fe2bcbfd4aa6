#include <numeric>

#include "codec/paper/codebook.h"
#include "codec/stream/sequence_index.h"
#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

std::vector<std::uint8_t> encode_codebook(const Codebook& codebook) {
    // Codewords are sent over their greatest common divisor: the encoder may have rounded them to a coarser grid.
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

std::vector<std::uint8_t> write_codebook_payload(std::uint8_t purpose, std::uint32_t number, const Codebook& codebook) {
    ByteWriter out;
    out.u8(purpose);
    out.varint(number);
    out.bytes(encode_codebook(codebook));
    return out.take();
}

}  // namespace htvm::internal
