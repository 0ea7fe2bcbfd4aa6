// What a mesh file says of its texture, before any image is read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace htvm {

struct TextureReference {
    struct Image {
        std::string name;                 // of its file, from the mesh's folder
        std::vector<std::uint8_t> bytes;  // of the image itself, if it is inside of the mesh's file
    };
    std::vector<Image> images;  // each once; several if parts of the mesh have different ones
    bool is_partial = false;    // parts of the mesh have no image, though others have
    // An OBJ names its images in files of their own (read_obj_materials):
    std::vector<std::string> material_files;
    std::vector<std::string> materials;  // that faces use; empty text: none was named
};

// Adds an image by its name, once.
inline void add_image(TextureReference& texture, const std::string& name) {
    for (const auto& image : texture.images)
        if (image.name == name) return;
    texture.images.push_back({name, {}});
}

}  // namespace htvm
