// Codebooks of the entropy-constrained vector quantiser (paper, section IV-C2), and the layers that they code: geometry
// and colour residuals of EP-frames, one index each. A codebook is a packet of its own, since it outlives the frame
// that it was made for. How it is trained: vector_quantiser_enc.h.
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

// A codebook packet.
inline constexpr std::uint8_t codebook_for_geometry = 0;
inline constexpr std::uint8_t codebook_for_colour = 1;
struct NumberedCodebook {
    std::uint8_t purpose = codebook_for_geometry;
    std::uint32_t number = 0;  // EP-frames name it by this
    Codebook codebook;
};
std::vector<std::uint8_t> write_codebook_payload(std::uint8_t purpose, std::uint32_t number, const Codebook& codebook);
Result<NumberedCodebook> read_codebook_payload(std::span<const std::uint8_t> payload);

// The residuals of a layer in the order E^ord: indices into the codebook, and what they decode to. An escape's value is
// a multiple of escape_step in each component.
struct QuantisedResiduals {
    std::vector<std::uint16_t> indices;
    std::vector<ResidualVector> values;
};

std::vector<std::uint8_t> encode_residuals(const QuantisedResiduals& residuals, const Codebook& codebook);
Result<std::vector<ResidualVector>> decode_residuals(std::span<const std::uint8_t> bytes, std::size_t count,
                                                     const Codebook& codebook);

}  // namespace htvm::internal
