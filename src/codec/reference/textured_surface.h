// A reference whose triangles lie in a texture's picture, and as it is shown. A vertex on a seam has other coordinates
// in each chart. Frames refer to the mesh without seams; what is shown repeats such vertices behind it. Where a
// reference has detail, that lies on its triangles: a vertex of the detail is in the middle of its edge in the picture,
// too.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/surface_detail.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// The texture coordinates of charts are whole numbers: the picture's sides are 2^picture_bits.
inline constexpr int picture_bits = 16;
inline constexpr double chart_texcoord_unit = 1 << picture_bits;
// A vertex has at most so many coordinates: this bounds the time that few bytes can make a decoder take.
inline constexpr std::size_t most_texcoords_of_vertex = 255;

using CornerTexcoords = std::array<QuantisedTexcoord, 3>;

// A reference's surface with its texture coordinates, and as it is shown with its detail.
struct TexturedSurface {
    std::vector<CornerTexcoords> corners;      // of each triangle of the reference; empty: there are none
    std::vector<std::uint32_t> copied;         // of each vertex that is repeated behind the others, which one it is
    std::vector<Triangle> triangles;           // as shown, in the order of the reference's, or of its detail's
    std::vector<QuantisedTexcoord> texcoords;  // of each vertex as shown, in 2^-picture_bits of the picture
    bool empty() const { return corners.empty(); }
};

// The first coordinates of a vertex, in the order of triangles, are its own; each other pair that it has gets a copy.
// vertices: of the reference. Errors: corrupt_stream if a vertex has more than most_texcoords_of_vertex.
Result<TexturedSurface> textured_surface(std::size_t vertices, std::span<const Triangle> triangles,
                                         std::vector<CornerTexcoords> corners);
// As it is shown with the first levels of its detail. There is no error with some levels if there is none with all.
Result<TexturedSurface> textured_surface(std::size_t vertices, std::span<const Triangle> triangles,
                                         std::vector<CornerTexcoords> corners, const SurfaceDetail& detail,
                                         std::size_t shown);

// After a patch: triangles that stay keep their coordinates. stays: the vertices of the mesh before that stay,
// ascending; the triangles of these come first in the new mesh. before: the coordinates of all triangles before.
std::vector<CornerTexcoords> corners_that_stay(std::span<const CornerTexcoords> before,
                                               std::span<const Triangle> triangles_before, std::size_t vertices_before,
                                               std::span<const std::uint32_t> stays);

// A mesh that has the reference's vertices, and those of its detail, as it is shown; itself if the reference has no
// texture coordinates.
LatticeMesh shown_mesh(LatticeMesh mesh, const TexturedSurface& textured);

}  // namespace htvm::internal
