// Pictures for people: with soft edges (anti-aliased), and with a share of the background in every pixel. Drawn by
// render.h several times larger, then reduced; pictures that are measured are not.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/render.h"

namespace htvm {

struct SmoothPicture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;  // 4 bytes per pixel, row by row from the top left; not multiplied by alpha
};

// The camera, zoomed in or out until the mesh fills the picture up to the margin, a share of it on each side. As it is
// if it sees no vertex beside its axis; vertices that are not shown (mesh_measures.h) do not count.
Camera zoomed_to(const Mesh& mesh, const Camera& camera, double margin);

// samples: across a pixel, 1..16; a pixel is the mean of samples * samples, as light. The canvas is that much larger
// than the picture and can be used again.
SmoothPicture draw_smoothly(const DrawableMesh& drawable, const Camera& camera, int samples, Canvas& canvas,
                            internal::Threads threads = {});

// The picture on a background of one colour: 3 bytes per pixel.
std::vector<std::uint8_t> on_background(const SmoothPicture& picture, const Colour& background);

// An 8-bit PNG file: on a background, or, without one, with an alpha channel. bad_input if libpng fails.
Result<std::vector<std::uint8_t>> png_of(const SmoothPicture& picture, const std::optional<Colour>& background);

}  // namespace htvm
