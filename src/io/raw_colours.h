// Colours as a file has them, until it is known in which range they are (colour_range.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"
#include "io/colour_range.h"

namespace htvm {

// What the type of a component says of its range.
enum class ColourNumbers : std::uint8_t {
    bytes,      // 0..255
    integers,   // 0..255 or 0..65535: a 1 is no full level
    fractions,  // nothing
};

struct RawColours {
    std::array<ColourNumbers, 3> numbers{};  // of red, green, blue
    std::vector<Vector3f> values;            // what is not a number is 0
};

ColourLevels levels_of(const RawColours& colours);
Colour colour_of(const Vector3f& value, const std::array<ColourNumbers, 3>& numbers, ColourRange range);
std::vector<Colour> colours_of(const RawColours& colours, ColourRange range);

}  // namespace htvm
