#include "codec/paper/residual_layer.h"
#include "core/lattice.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

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
