// Attributes that are small arrays of whole numbers (normals, texture coordinates), coded without loss of what they
// were quantised to: each predicted, the residuals range coded. The encoder tries the predictors at hand and names the
// cheapest in the layer's first byte.
//
// Value is std::array<std::int32_t, 2> or <.., 3>, one per vertex. Every component lies within +-attribute_limit. No
// vertices give no bytes. Errors of decoding: corrupt_stream where the bytes end too early, name a predictor that is
// not at hand or lead beyond the limit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/neighbours.h"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::int32_t attribute_limit = 1 << 24;

// Intra frames: predicted from the mesh. values.size() == neighbours.vertex_count().
template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values, const Neighbours& neighbours);
template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes, const Neighbours& neighbours);

// Frames with a reference: predicted by the caller's values, one per vertex, or by the vertex before.
// values.size() == predictions.size(), predictions within the limit too.
template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values,
                                                  const std::vector<Value>& predictions);
template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                   const std::vector<Value>& predictions);

}  // namespace htvm::internal
