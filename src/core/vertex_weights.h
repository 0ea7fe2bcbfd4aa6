// How much each handle moves a vertex. A handle is a rigid transform with a smooth region of influence: a bone, or a
// node of a deformation graph. The weights of bones come from codec/reference/skinning.h, those of nodes from
// codec/reference/deformation_nodes.h.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace htvm::internal {

inline constexpr int weight_bits = 12;
inline constexpr std::size_t handles_per_vertex = 4;

// The handles that move one vertex, by descending weight; of equal weights, the lower handle first. The weights sum to
// 2^weight_bits; unused entries have weight 0 and handle 0.
struct VertexWeights {
    std::array<std::uint16_t, handles_per_vertex> handle{};
    std::array<std::uint16_t, handles_per_vertex> weight{};
    bool operator==(const VertexWeights&) const = default;
};

using HandleWeights = std::vector<VertexWeights>;  // one per vertex

}  // namespace htvm::internal
