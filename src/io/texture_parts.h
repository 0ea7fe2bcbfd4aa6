// The parts of a mesh that look alike, as its file tells them: triangles of one material.
#pragma once

#include <cstddef>
#include <vector>

#include "htvm/mesh.hpp"
#include "io/texture_reference.h"

namespace htvm {

// The part of a triangle; texture.parts must not be empty.
std::size_t part_of_triangle(const TextureReference& texture, std::size_t triangle);

// Which parts triangles wear, one flag for each part.
std::vector<bool> worn_parts(const Mesh& mesh, const TextureReference& texture);

// The colours of vertices where parts have colours, and none that is worn has an image: the mean of the parts around,
// by area; of a part without a colour, and of a vertex without triangles, white. Empty if no part that is worn has a
// colour, or all have the same that says nothing: white, or the grey of 0.8 that programs write where none was chosen.
std::vector<Colour> colours_of_parts(const Mesh& mesh, const TextureReference& texture);

// Whether there is at least one colour and all are the same: a mesh that was never coloured, in many programs' files.
bool is_one_colour(const std::vector<Colour>& colours);

}  // namespace htvm
