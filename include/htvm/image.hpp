// An image of 8-bit colours, as textures and pictures are.
//
// Threads and lifetimes. A plain value: copies are independent.
#pragma once

#include <cstdint>
#include <vector>

namespace htvm {

struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // 3 bytes per pixel, row by row from the top left
};

}  // namespace htvm
