// The planes of a video's picture, and their conversion from and to red, green, blue (docs/bitstream.md, section 14).
//
// Threads and lifetimes. Functions keep no state. A view of planes lends them, and is valid as long as these.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "htvm/image.hpp"
#include "htvm/texture.hpp"

namespace htvm {

// Luma, blue difference, red difference, 8 bits each; the latter two with a sample for every 2 x 2 pixels, in their
// middle. Sides that are odd are rounded up there. On loan from whoever gives it out.
struct PicturePlanes {
    std::uint32_t width = 0, height = 0;  // pixels
    ColourMatrix matrix = ColourMatrix::bt709;
    bool full_range = false;
    std::array<const std::uint8_t*, 3> samples{};
    std::array<std::ptrdiff_t, 3> strides{};  // bytes from row to row
};

// Planes that own their samples.
class OwnPlanes {
public:
    // Converts an image, which must not be empty. Chroma is the mean of its four pixels.
    explicit OwnPlanes(const Image& image, ColourMatrix matrix = ColourMatrix::bt709, bool full_range = false);
    PicturePlanes view() const;

private:
    PicturePlanes shape_;
    std::array<std::vector<std::uint8_t>, 3> samples_;
};

// Converts back; chroma is interpolated between its samples, and the gains are applied.
Image image_of(const PicturePlanes& planes,
               const std::array<std::uint16_t, 3>& gains = {picture_gain_one, picture_gain_one, picture_gain_one});

}  // namespace htvm
