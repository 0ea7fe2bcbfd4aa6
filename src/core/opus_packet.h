// What a packet of Opus (RFC 6716, section 3) says of itself.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace htvm::internal {

// The samples, at 48 kHz, that it decodes to: 120 to 5760. Nothing if it is malformed.
std::optional<std::uint32_t> opus_samples(std::span<const std::uint8_t> packet);

}  // namespace htvm::internal
