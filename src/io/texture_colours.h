// Vertex colours from a texture, for coders and metrics of colours at vertices.
#pragma once

#include <vector>

#include "core/image.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm {

// A colour for every vertex: the mean of the texture over the triangles around it, each point by how near it is to
// that vertex among its triangle's (its barycentric share), so that what is finer than the mesh does not alias. Nothing
// is read beyond the triangles, where the image shows other parts of the surface. A vertex without triangles has the
// colour at its own coordinates. The mesh must have texture coordinates, and the image pixels.
std::vector<Colour> colours_from_texture(const Mesh& mesh, const Image& image, internal::Threads threads = {});

// The same of a mesh as texture_file.h reads it, multiplied, in light, by the colours that its vertices have.
// spacing: as of with_vertex_colours().
std::vector<Colour> colours_with_texture(const TexturedMesh& captured, internal::Threads threads = {},
                                         double spacing = 1);

// The mesh with these colours in place of the texture and its coordinates, multiplied, in light, by those that its
// vertices have, as glTF means both together; where they are not meant so, texture_file.h leaves them out. Vertices at
// one place, of which a seam of the texture needs one for each side, become one if their normals agree, with the mean
// of their colours by area; triangles that had two corners there are dropped. spacing: of the points, in texels, > 0; 1
// is exact, and 2 takes a quarter of the time, for colours that nobody sees: some of what lies a texel beyond the
// triangles comes in.
Mesh with_vertex_colours(const TexturedMesh& captured, internal::Threads threads = {}, double spacing = 1);

}  // namespace htvm
