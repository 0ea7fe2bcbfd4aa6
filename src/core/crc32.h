// CRC-32 as in zlib and PNG (reflected polynomial 0xEDB88320).
#pragma once

#include <cstdint>
#include <span>

namespace htvm::internal {

std::uint32_t crc32(std::span<const std::uint8_t> data);

}  // namespace htvm::internal
