// PNG images, by libpng.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// As read_image() does (image_file.h).
Result<Image> read_png_image(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage);

}  // namespace htvm::internal
