// The statements of an OBJ file, before the corners of its faces become vertices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

inline constexpr std::uint32_t no_index = 0xffffffff;

struct ObjCorner {
    std::uint32_t position = no_index;
    std::uint32_t texcoord = no_index;
    std::uint32_t normal = no_index;
    bool operator==(const ObjCorner&) const = default;
};

struct ObjPolygon {
    std::size_t first_corner = 0;
    std::size_t corner_count = 0;  // at least 3
    std::size_t line = 0;
    std::uint16_t part = 0;  // of the texture
};

struct ObjText {
    std::vector<Vector3f> positions;  // without the options' origin; NaN where one is not finite
    std::vector<Vector3f> colours;    // as long as positions, or empty; as the file has them; NaN if the line has none
    std::vector<Vector2f> texcoords;
    std::vector<Vector3f> normals;
    std::vector<ObjCorner> corners;  // with indices below the lengths of the lists, or none
    std::vector<ObjPolygon> polygons;
    TextureReference texture;  // without part_of_triangle
};

// Fails as read_obj() does (obj.h).
Result<ObjText> read_obj_text(std::string_view text, const MeshReadOptions& options, MeshFindings& findings);

}  // namespace htvm
