// Codebooks of the entropy-constrained vector quantiser (paper, section IV-C2), and the layers coded with them:
// geometry and colour residuals of EP-frames, one index each. A codebook has a packet of its own, because it is used by
// more frames than the one it was made for. encoder/bones/vector_quantiser.h trains them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"
#include "htvm/result.hpp"

namespace htvm::internal {

using ResidualVector = std::array<std::int32_t, 3>;

// Codewords by ascending code length. A code length is the number of bits, in eighths, that an index was expected to
// cost when the codebook was made; the index model gets its starting probabilities from it, and the encoder its cost.
// The index codewords.size() is the escape: a residual that no codeword fits, sent as multiples of escape_step.
struct Codebook {
    std::vector<ResidualVector> codewords;
    std::vector<std::uint16_t> lengths;  // codewords.size() + 1 entries, the last for the escape; 0 .. max_length
    std::int32_t escape_step = 1;        // >= 1
    bool operator==(const Codebook&) const = default;
};

inline constexpr std::size_t max_codewords = 4095;
inline constexpr std::uint16_t max_length = 8 * 20;

std::vector<std::uint8_t> encode_codebook(const Codebook& codebook);
Result<Codebook> decode_codebook(std::span<const std::uint8_t> bytes);

// The model of the indices, with the codebook's lengths as starting probabilities.
SymbolModel index_model(const Codebook& codebook);

// A packet that holds a codebook.
inline constexpr std::uint8_t codebook_for_geometry = 0;
inline constexpr std::uint8_t codebook_for_colour = 1;
struct NumberedCodebook {
    std::uint8_t purpose = codebook_for_geometry;
    std::uint32_t number = 0;  // by which EP-frames refer to it
    Codebook codebook;
};
std::vector<std::uint8_t> write_codebook_payload(std::uint8_t purpose, std::uint32_t number, const Codebook& codebook);
Result<NumberedCodebook> read_codebook_payload(std::span<const std::uint8_t> payload);

// The residuals of a layer in the order E^ord: indices into the codebook, and the values they decode to. Each component
// of an escape's value is a multiple of escape_step.
struct QuantisedResiduals {
    std::vector<std::uint16_t> indices;
    std::vector<ResidualVector> values;
};

std::vector<std::uint8_t> encode_residuals(const QuantisedResiduals& residuals, const Codebook& codebook);
Result<std::vector<ResidualVector>> decode_residuals(std::span<const std::uint8_t> bytes, std::size_t count,
                                                     const Codebook& codebook);

}  // namespace htvm::internal
