// A mesh as captured or as decoded: one frame of a human time-varying mesh.
//
// Threads and lifetimes. Plain values: copies are independent. A MeshView lends arrays of somebody else, and is valid
// as long as these.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace htvm {

using Vector3f = std::array<float, 3>;
using Vector2f = std::array<float, 2>;
using Colour = std::array<std::uint8_t, 3>;     // red, green, blue
using Triangle = std::array<std::uint32_t, 3>;  // vertex indices, counter-clockwise seen from outside

// Positions are in millimetres. Every attribute array is either empty (the mesh does not have it) or as long as
// positions. The only requirement on triangles is that their indices are < positions.size(): non-manifold, open,
// degenerate and duplicate triangles and isolated vertices are all allowed, and so is a mesh without triangles or
// without vertices.
struct Mesh {
    std::vector<Vector3f> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
    std::vector<Vector3f> normals;    // unit length
    std::vector<Vector2f> texcoords;  // usually 0..1; any finite value is allowed
};

// A mesh on loan: the arrays belong to something else, which says how long they stay valid.
struct MeshView {
    std::span<const Vector3f> positions;
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;
    std::span<const Vector3f> normals;
    std::span<const Vector2f> texcoords;
};

inline MeshView view_of(const Mesh& mesh) {
    return {mesh.positions, mesh.triangles, mesh.colours, mesh.normals, mesh.texcoords};
}

inline Mesh copy_of(const MeshView& mesh) {
    return {{mesh.positions.begin(), mesh.positions.end()},
            {mesh.triangles.begin(), mesh.triangles.end()},
            {mesh.colours.begin(), mesh.colours.end()},
            {mesh.normals.begin(), mesh.normals.end()},
            {mesh.texcoords.begin(), mesh.texcoords.end()}};
}

}  // namespace htvm
