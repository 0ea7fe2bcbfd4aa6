// How large a decoder of VP9 would have to make its pictures for a packet, before it does: libvpx has no limit of its
// own. The VP9 bitstream specification, 6.1, 6.2 and annex B.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace htvm::internal {

// The longest side that any frame of the packet names; 0 if all have the sizes of those before. Nothing if its headers
// are cut short or malformed.
std::optional<std::uint32_t> longest_vp9_side(std::span<const std::uint8_t> packet);

}  // namespace htvm::internal
