// What files say of the corners of faces, brought to vertices, which are all that a mesh has.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// Gives vertices the mean of the colours that their triangles have there, by the triangles' areas; those without a
// triangle are white. colours: of each triangle's corners, as long as the triangles.
void give_colours_of_corners(Mesh& mesh, std::span<const std::array<Colour, 3>> colours);

// Gives the corners of triangles their texture coordinates, as long as the triangles. Vertices whose corners have
// several become several: the first keeps the vertex's index, the others are appended, in the order in which they are
// met. Fails (limit) if that makes more than most_vertices.
Result<void> give_texcoords_of_corners(Mesh& mesh, std::span<const std::array<Vector2f, 3>> texcoords,
                                       std::uint64_t most_vertices);

}  // namespace htvm
