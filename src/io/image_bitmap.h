// BMP and TGA images. None of the libraries that read other formats here reads these, and each is a header and rows of
// pixels.
#pragma once

#include <cstdint>
#include <span>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm::internal {

bool is_bmp(std::span<const std::uint8_t> bytes);
// Reads 1, 4, 8, 16, 24 and 32 bits a pixel, with palettes, masks or runs of 4 and 8 bits, from either edge.
Result<Image> read_bmp_image(std::span<const std::uint8_t> bytes, int largest_side);

// By the mark at its end, or, as older files have none, by a header in which everything is possible.
bool is_tga(std::span<const std::uint8_t> bytes);
// It has palettes, colours or greys, of 8, 15, 16, 24 and 32 bits a pixel, as runs or not, from any corner.
// Unsupported: a file from the bottom without the mark. ImageMagick 6 writes such files of rows from the top, others as
// they say, and nothing tells them apart.
Result<Image> read_tga_image(std::span<const std::uint8_t> bytes, int largest_side);

}  // namespace htvm::internal
