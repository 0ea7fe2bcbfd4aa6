// A texture for the synthetic capture, as studios deliver them: in every frame an atlas of charts and its image. Each
// second has a layout of its own; within it every place of the body keeps its place in the image, though the mesh is a
// new one in every frame. The image has a camera's noise, and its exposure and white balance drift.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/thread.h"
#include "htvm/result.hpp"
#include "synth/synth.h"

namespace htvm {

struct SynthTextureOptions {
    int size = 1024;      // pixels along each side, 64..4096
    double noise = 2;     // levels, RMS, new in every texel and frame
    double exposure = 5;  // percent by which the exposure goes up and down
};

struct SynthTexture {
    Mesh mesh;  // the frame's, with texture coordinates and without colours. Vertices on the border of a chart are
                // there once for each chart: first as in the frame, the others at the end
    std::vector<std::uint32_t> vertices;  // for each, the frame's vertex that it is
    Image image;                          // as a camera would have it
    Image exact;                          // the colours of the surface, without noise and exposure
    std::array<double, 3> gain{1, 1, 1};  // that the exposure multiplied red, green and blue by
    int layout = 0;                       // the second, and with it the layout, that the frame belongs to
};

// Fails (bad_input) with what is wrong with the options, if anything.
Result<void> check_texture_options(const SynthTextureOptions& options);

// For a frame of synth_frame() with the same options and number; the same for any number of threads.
SynthTexture synth_texture(const SynthOptions& options, const SynthTextureOptions& texture, const SynthFrame& made,
                           int frame, internal::Threads threads = {});

}  // namespace htvm
