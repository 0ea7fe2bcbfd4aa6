// The element "vertex" of a PLY file.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"
#include "io/ply_body.h"
#include "io/raw_colours.h"

namespace htvm {

// Reads the vertices into the mesh: positions that are not finite, without the origin, become NaN. Colours whose type
// says their range go into the mesh, others into `colours`.
Result<void> read_ply_vertices(PlyBody& body, const PlyElement& element, const MeshReadOptions& options, Mesh& mesh,
                               RawColours& colours, MeshFindings& findings);

// The names of red, green and blue, in lower case, the likeliest first.
using PlyColourNames = std::array<std::string_view, 3>;
inline constexpr std::array ply_colour_names = {
    PlyColourNames{"red", "green", "blue"},
    PlyColourNames{"diffuse_red", "diffuse_green", "diffuse_blue"},
    PlyColourNames{"r", "g", "b"},
    PlyColourNames{"color_r", "color_g", "color_b"},
    PlyColourNames{"colour_r", "colour_g", "colour_b"},
    PlyColourNames{"vertex_red", "vertex_green", "vertex_blue"},
};
// A list of that name holds red, green, blue and perhaps more: on a vertex once, on a face once or for each corner.
bool is_ply_colour_list(const PlyProperty& property);

// Which numbers a component of that type is.
ColourNumbers ply_colour_numbers(PlyType type);
// A component of that type: of bytes with a sign, those below 0 are the upper half.
double ply_colour_value(double value, PlyType type);

// The property that is no list and has that name; nothing if there is none.
std::optional<std::size_t> ply_scalar_named(const PlyElement& element, std::string_view name);

}  // namespace htvm
