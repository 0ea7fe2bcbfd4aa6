// The elements "face" and "tristrips" of a PLY file.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_check.h"
#include "io/ply_body.h"
#include "io/polygon.h"
#include "io/raw_colours.h"

namespace htvm {

// What faces say besides the mesh's triangles, which are the fans of their polygons. Each list is empty if nothing is
// said, and may be shorter than the triangles, of which the last then have nothing.
struct PlyFaces {
    std::vector<Fan> fans;                           // of more than one triangle
    std::vector<std::array<Vector2f, 3>> texcoords;  // of each triangle's corners
    std::vector<std::array<Vector3f, 3>> colours;    // likewise, as the file has them
    std::array<ColourNumbers, 3> colour_numbers{};
    std::vector<std::int32_t> textures;  // of each triangle, which of the header's; none if there is no such
};

struct PlyFaceLimits {
    std::uint64_t vertices = 0;  // an index must be below
    std::uint64_t most_triangles = 0;
};

Result<void> read_ply_faces(PlyBody& body, const PlyElement& element, const PlyFaceLimits& limits, Mesh& mesh,
                            PlyFaces& faces);

// Strips of triangles that turn one way and the other, parted by -1. Triangles that use a vertex twice only join strips
// and are left out.
Result<void> read_ply_strips(PlyBody& body, const PlyElement& element, const PlyFaceLimits& limits, Mesh& mesh);

}  // namespace htvm
