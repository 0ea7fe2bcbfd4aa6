// How the meshes of a stream wear a texture.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

#include <cstdint>

namespace htvm {

enum class TextureLayout : std::uint8_t {
    none,        // the stream has no texture
    captured,    // the meshes have the capture's own texture coordinates
    charts,      // the stream has a layout of its own: each reference's surface is cut into a few large charts, each
                 // projected onto a plane
    projection,  // the pictures are one camera's film: each frame says how that camera saw its surface
};

// What the sequence header says of a stream's texture.
struct StreamTexture {
    TextureLayout layout = TextureLayout::none;
    int width = 0, height = 0;  // of the pictures, pixels, 1..most_picture_side (texture.hpp); 0 without a layout
    bool operator==(const StreamTexture&) const = default;
};

}  // namespace htvm
