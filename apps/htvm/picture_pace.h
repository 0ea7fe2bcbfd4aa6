// Whether a machine draws and codes pictures as fast as somebody waits for them, by trying it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "command_line/capture.h"
#include "core/image.h"
#include "htvm/mesh.hpp"
#include "picture_track.h"

namespace htvm::app {

// What drawing and coding the first mesh's picture takes, milliseconds: each once the layout is known, as they come.
// use: picture or projection. Nothing where it cannot be tried.
std::optional<double> milliseconds_a_picture(const TexturedMesh& first, TextureAs use,
                                             const TexturePictureOptions& options, double quality, unsigned threads);

// Why pictures are too slow where frames come every so many milliseconds, for people; empty: they are not. Meshes are
// left half of the time, in which less effort makes room for them.
std::string too_slow(double milliseconds_a_picture, double milliseconds_a_frame);

// CaptureOptions::pictures_too_slow, for pictures of these qualities, all of each frame, and meshes that may take no
// longer than the deadline, milliseconds; 0: none.
struct PicturePace {
    TexturePictureOptions options;
    std::vector<double> qualities;
    unsigned threads = 0;
    double deadline = 0;
};
std::function<std::string(const TexturedMesh&, TextureAs, double)> pictures_too_slow(const PicturePace& pace);

}  // namespace htvm::app
