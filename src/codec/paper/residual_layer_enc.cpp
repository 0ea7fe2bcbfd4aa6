#include "codec/paper/residual_layer.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

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

}  // namespace htvm::internal
