// Motion-based coding (paper, section V): which bones' sub-meshes an EP-frame codes; the rest is animated.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/prediction.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// One bit a bone, bone i in bit i % 8 of byte i / 8.
std::vector<std::uint8_t> write_coded_bones(const std::vector<bool>& coded);
Result<std::vector<bool>> read_coded_bones(std::span<const std::uint8_t> bytes, std::size_t bones);

// One a reference vertex: 1 where its bone is coded. Residuals refer to such vertices alone.
std::vector<std::uint8_t> vertices_of_coded_bones(const ReferenceMesh& reference, const std::vector<bool>& coded);
// The opposite: 1 where the vertex stands for a part that is animated.
std::vector<std::uint8_t> still_vertices(const ReferenceMesh& reference, const std::vector<bool>& coded);

}  // namespace htvm::internal
