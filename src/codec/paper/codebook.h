// A codebook of the entropy-constrained vector quantiser (paper, section IV-C2): what a coded index stands for.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"
#include "htvm/result.hpp"

namespace htvm::internal {

using ResidualVector = std::array<std::int32_t, 3>;

// Codewords by ascending code length. A code length is the number of bits that an index was expected to cost when the
// codebook was made, in eighths; it gives the index model its starting probabilities, and the encoder its cost.
// The index codewords.size() is the escape: a residual that no codeword fits, sent as multiples of escape_step.
struct Codebook {
    std::vector<ResidualVector> codewords;
    std::vector<std::uint16_t> lengths;  // codewords.size() + 1, the last for the escape; 0 .. max_length
    std::int32_t escape_step = 1;        // >= 1
    bool operator==(const Codebook&) const = default;
};

inline constexpr std::size_t max_codewords = 4095;
inline constexpr std::uint16_t max_length = 8 * 20;

std::vector<std::uint8_t> encode_codebook(const Codebook& codebook);
Result<Codebook> decode_codebook(std::span<const std::uint8_t> bytes);

// The model of the indices, with the codebook's lengths as starting probabilities.
SymbolModel index_model(const Codebook& codebook);

}  // namespace htvm::internal
