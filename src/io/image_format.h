// Which format an image file is of, among those that are not read, for messages.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace htvm::internal {

// "a TIFF image"; empty: none that is known.
std::string unread_format(std::span<const std::uint8_t> bytes);

}  // namespace htvm::internal
