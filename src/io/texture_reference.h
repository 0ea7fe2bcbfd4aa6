// What a mesh file says of its texture, before any image is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm {

struct TextureReference {
    struct Image {
        std::string name;                 // of its file, from the mesh's folder
        std::vector<std::uint8_t> bytes;  // of the image itself, if it is inside of the mesh's file
    };
    std::vector<Image> images;  // each once; several if parts of the mesh have different ones

    // A part of the mesh that looks alike: triangles of one material.
    struct Part {
        std::string material;              // its name, of an OBJ; empty: none was named
        std::optional<std::size_t> image;  // which of `images`; nothing: it has none
        std::optional<Colour> colour;      // what it is painted where it has no image, or what multiplies the image
    };
    std::vector<Part> parts;                      // empty: nothing is said of any
    std::vector<std::uint16_t> part_of_triangle;  // as long as the triangles; empty: all are of the first part

    std::vector<std::string> material_files;  // in which an OBJ's materials stand (obj_material.h)
    // Colours of vertices multiply those of the image, as glTF has it; else they stand in for them.
    bool colours_multiply = false;
};

// The image of that name, added if it is not there yet.
inline std::size_t add_image(TextureReference& texture, const std::string& name) {
    for (std::size_t i = 0; i < texture.images.size(); ++i)
        if (texture.images[i].name == name) return i;
    texture.images.push_back({name, {}});
    return texture.images.size() - 1;
}

}  // namespace htvm
