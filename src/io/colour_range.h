// Which range colours are in where their type does not say it: floats are 0..1 in some files and 0..255 in others,
// 16-bit integers 0..255 or 0..65535. Single values decide nothing: some overshoot, some are damaged.
#pragma once

#include <cstdint>
#include <optional>

namespace htvm {

enum class ColourRange : std::uint8_t { unit, bytes, words };  // 0..1, 0..255, 0..65535

// How many components lie where: of one mesh, or added up over a capture. Zeros say nothing and are not counted.
struct ColourLevels {
    std::uint64_t up_to_unit = 0, up_to_bytes = 0, above = 0;
    std::uint64_t fractions = 0;  // of those up to 1, which are not whole numbers
    void count(double value);
    ColourLevels& operator+=(const ColourLevels& other);
    bool any() const { return up_to_unit + up_to_bytes + above > 0; }
};

// The range by the bulk of the components: a few beyond it are clamped. unit where nothing is known.
ColourRange colour_range_of(const ColourLevels& levels);

// The range that these alone leave no doubt about: nothing for so dark a frame that its levels may be 0 and 1 of 255.
std::optional<ColourRange> certain_range_of(const ColourLevels& levels);

// A component as 0..255: rounded, clamped; not a number is 0.
std::uint8_t colour_level(double value, ColourRange range);

}  // namespace htvm
