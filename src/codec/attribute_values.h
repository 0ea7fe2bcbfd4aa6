// Attributes that are small arrays of whole numbers a vertex (normals, texture coordinates), coded without loss of what
// they were quantised to: each predicted, the residuals range coded. The encoder tries the predictors at hand and names
// the cheapest in the layer's first byte.
//
// Every component lies within +-attribute_limit. No vertices give no bytes. Errors of decoding: corrupt_stream where
// the bytes end too early, name a predictor that is not at hand or lead beyond the limit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra_neighbours.h"
#include "htvm/result.hpp"

namespace htvm {

inline constexpr std::int32_t attribute_limit = 1 << 24;

template <std::size_t components>
using AttributeValues = std::vector<std::array<std::int32_t, components>>;

// Intra frames: predicted from the mesh. values.size() == neighbours.vertex_count(). For two and three components.
template <std::size_t components>
std::vector<std::uint8_t> encode_attribute_values(const AttributeValues<components>& values,
                                                  const Neighbours& neighbours);
template <std::size_t components>
Result<AttributeValues<components>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                            const Neighbours& neighbours);

// Frames with a reference: predicted by the caller's values, one a vertex, or by the vertex before. For two and three
// components; values.size() == predictions.size(), predictions within the limit too.
template <std::size_t components>
std::vector<std::uint8_t> encode_attribute_values(const AttributeValues<components>& values,
                                                  const AttributeValues<components>& predictions);
template <std::size_t components>
Result<AttributeValues<components>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                            const AttributeValues<components>& predictions);

}  // namespace htvm
