// sRGB: the levels in which 8-bit colours are kept, and the light they stand for, which is what averages, products and
// glTF are about.
#pragma once

#include <cstdint>

namespace htvm::internal {

// 0..1 for the levels 0..255.
float light_of(std::uint8_t level);

// The nearest level; below 0, and for NaN, 0, above 1, 255. level_of(light_of(level)) is level.
std::uint8_t level_of(float light);

}  // namespace htvm::internal
