// DDS images, which players in game engines load: BC1, BC2 and BC3 (DXT1 to DXT5), whose colours are blocks of 4 x 4
// pixels, and uncompressed ones of 8 to 32 bits a pixel. The first picture is read: no smaller ones, no other faces of
// a cube. Rows come from the top, as texconv and ImageMagick write them.
#pragma once

#include <cstdint>
#include <span>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm::internal {

bool is_dds(std::span<const std::uint8_t> bytes);
Result<Image> read_dds_image(std::span<const std::uint8_t> bytes, int largest_side);

}  // namespace htvm::internal
