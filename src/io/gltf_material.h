// What a primitive of a glTF looks like: an image, and the light that multiplies it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "io/gltf_file.h"

namespace htvm::internal {

struct GltfLook {
    std::optional<std::uint64_t> material;           // its number
    std::optional<std::uint64_t> image;              // its number
    std::array<double, 3> factor{1, 1, 1};           // of light; multiplies the image, or the colours of vertices
    bool takes_vertex_colours = true;                // they multiply too
    bool is_see_through = false;                     // by the image's alpha
    bool is_shown = true;                            // not by an alpha of nothing
    std::uint64_t texcoord_set = 0;                  // which texture coordinates place the image
    std::array<double, 6> placed{1, 0, 0, 0, 1, 0};  // what becomes of them: two rows of x, y and 1
};

// By the base colour, or the diffuse one of KHR_materials_pbrSpecularGlossiness; by what it emits where the base colour
// is black, or has neither an image nor colours of vertices while the emission has an image: so surfaces were published
// before there was KHR_materials_unlit. Errors: bad_input, unsupported.
Result<GltfLook> gltf_look(const GltfFile& file, const nlohmann::json& primitive, MeshFindings* findings);

}  // namespace htvm::internal
