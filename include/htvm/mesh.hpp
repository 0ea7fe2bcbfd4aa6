// A mesh as captured or as decoded: one frame of a human time-varying mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace htvm {

using Vector3f = std::array<float, 3>;
using Vector2f = std::array<float, 2>;
using Colour = std::array<std::uint8_t, 3>;     // red, green, blue
using Triangle = std::array<std::uint32_t, 3>;  // vertex indices, counter-clockwise seen from outside

// Positions are in millimetres. Every attribute array is either empty (the mesh has none) or as long as positions.
// Nothing is assumed of the triangles but that their indices are < positions.size(): non-manifold, open, degenerate,
// duplicate triangles and isolated vertices are all legal, and so is a mesh without triangles or without vertices.
struct Mesh {
    std::vector<Vector3f> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
    std::vector<Vector3f> normals;    // unit length
    std::vector<Vector2f> texcoords;  // usually 0..1, any finite value is legal
};

}  // namespace htvm
