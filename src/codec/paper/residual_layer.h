// A layer of vector-quantised residuals, geometry or colour: one codebook index each, in the order E^ord
// (paper, section IV-C2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/paper/codebook.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// Quantised residuals: indices into the codebook, and what they decode to. index == codewords.size() is the escape,
// whose value is a multiple of escape_step in each component.
struct QuantisedResiduals {
    std::vector<std::uint16_t> indices;
    std::vector<ResidualVector> values;
};

std::vector<std::uint8_t> encode_residuals(const QuantisedResiduals& residuals, const Codebook& codebook);
Result<std::vector<ResidualVector>> decode_residuals(std::span<const std::uint8_t> bytes, std::size_t count,
                                                     const Codebook& codebook);

}  // namespace htvm::internal
