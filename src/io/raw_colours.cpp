#include "io/raw_colours.h"

#include <algorithm>

namespace htvm {

ColourLevels levels_of(const RawColours& colours) {
    ColourLevels levels;
    for (std::size_t c = 0; c < 3; ++c) {
        if (colours.numbers[c] == ColourNumbers::bytes) continue;
        const bool is_integer = colours.numbers[c] == ColourNumbers::integers;
        for (const auto& value : colours.values)
            levels.count(static_cast<double>(is_integer && value[c] > 0 ? std::max(value[c], 2.0f) : value[c]));
    }
    return levels;
}

Colour colour_of(const Vector3f& value, const std::array<ColourNumbers, 3>& numbers, ColourRange range) {
    Colour colour{};
    for (std::size_t c = 0; c < 3; ++c) {
        const bool is_bytes =
            numbers[c] == ColourNumbers::bytes || (numbers[c] == ColourNumbers::integers && range == ColourRange::unit);
        colour[c] = colour_level(static_cast<double>(value[c]), is_bytes ? ColourRange::bytes : range);
    }
    return colour;
}

std::vector<Colour> colours_of(const RawColours& colours, ColourRange range) {
    std::vector<Colour> out(colours.values.size());
    std::ranges::transform(colours.values, out.begin(),
                           [&](const auto& value) { return colour_of(value, colours.numbers, range); });
    return out;
}

}  // namespace htvm
