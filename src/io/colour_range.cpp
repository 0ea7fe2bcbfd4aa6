#include "io/colour_range.h"

#include <algorithm>
#include <cmath>

namespace htvm {

void ColourLevels::count(double value) {
    constexpr double overshoot = 1.5;  // filters and exposure take levels somewhat beyond white
    if (!(value > 0)) return;
    fractions += value <= overshoot && value != std::floor(value);
    ++(value <= overshoot ? up_to_unit : value <= 255 * overshoot ? up_to_bytes : above);
}

ColourLevels& ColourLevels::operator+=(const ColourLevels& other) {
    up_to_unit += other.up_to_unit;
    up_to_bytes += other.up_to_bytes;
    above += other.above;
    fractions += other.fractions;
    return *this;
}

ColourRange colour_range_of(const ColourLevels& levels) {
    constexpr std::uint64_t one_of = 10;  // more components than this share are no outliers
    const auto all = levels.up_to_unit + levels.up_to_bytes + levels.above;
    if (levels.above * one_of > all) return ColourRange::words;
    return (levels.up_to_bytes + levels.above) * one_of > all ? ColourRange::bytes : ColourRange::unit;
}

std::optional<ColourRange> certain_range_of(const ColourLevels& levels) {
    constexpr std::uint64_t one_of = 10;
    const auto range = colour_range_of(levels);
    if (!levels.any() || (range == ColourRange::unit && levels.fractions * one_of <= levels.up_to_unit))
        return std::nullopt;
    return range;
}

std::uint8_t colour_level(double value, ColourRange range) {
    if (range == ColourRange::unit) value *= 255;
    if (range == ColourRange::words) value /= 257;
    if (!(value > 0)) return 0;
    return static_cast<std::uint8_t>(std::lround(std::min(value, 255.0)));
}

}  // namespace htvm
