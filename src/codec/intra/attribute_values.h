// Codes attributes that are small arrays of whole numbers (normals, texture coordinates), lossless after their
// quantisation: each is predicted, and the residuals are range coded. The encoder tries the available predictors and
// names the cheapest in the first byte of the layer.
//
// Value is std::array<std::int32_t, 2> or <.., 3>, one per vertex. Every component is within +-attribute_limit. Without
// vertices there are no bytes. Decoding gives corrupt_stream if the bytes end too early, name a predictor that is not
// available or exceed the limit.
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

// For intra frames: predicts from the mesh. values.size() == neighbours.vertex_count().
template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values, const Neighbours& neighbours);
template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes, const Neighbours& neighbours);

// For frames with a reference: predicts by values that the caller passes in, one per vertex, or by the previous vertex.
// values.size() == predictions.size(); the predictions must be within the limit too.
template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values,
                                                  const std::vector<Value>& predictions);
template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                   const std::vector<Value>& predictions);

}  // namespace htvm::internal
