// WebP images, by libwebp.
#pragma once

#include <cstdint>
#include <span>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// As read_image() does (image_file.h).
Result<Image> read_webp_image(std::span<const std::uint8_t> bytes, int largest_side);

}  // namespace htvm::internal
