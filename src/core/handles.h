// Handles: rigid transforms with a smooth region of influence (design, section 1). A bone is one, and so is a node of a
// deformation graph. Here is only how much each handle moves a vertex; codec/handle_weights.h derives it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace htvm::internal {

inline constexpr int weight_bits = 12;
inline constexpr std::size_t handles_a_vertex = 4;

// The handles that move one vertex, by descending weight, of equal ones the lower handle first. The weights sum to
// 2^weight_bits; unused entries have weight 0 and handle 0.
struct VertexWeights {
    std::array<std::uint16_t, handles_a_vertex> handle{};
    std::array<std::uint16_t, handles_a_vertex> weight{};
    bool operator==(const VertexWeights&) const = default;
};

using HandleWeights = std::vector<VertexWeights>;  // one a vertex

}  // namespace htvm::internal
