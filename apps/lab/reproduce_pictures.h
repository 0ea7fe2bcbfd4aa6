// Decoded frames drawn beside each other (figures 8, 9, 14 and 15).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "metrics/render.h"
#include "rd_coders.h"
#include "rd_source.h"
#include "reproduce_figure.h"

namespace htvm::lab {

// A coder at one setting, whose decoded frames are wanted.
struct PictureJob {
    CoderUnderTest coder;
    double geometry_step = 2, colour_step = 6;
    double rate = 0;                  // bpvf of the whole sequence at these steps, for the label
    std::vector<std::size_t> frames;  // wanted, rising
    std::size_t first = 0;            // frame to start coding at
};

// The decoded meshes of the job's frames. Coders that code every frame by itself skip what is not wanted.
Result<std::vector<Mesh>> decode_frames(const SourceFrames& source, const PictureJob& job, unsigned threads);

// The angle from which a body is seen from the front, degrees (ViewOptions::first_azimuth; y up): by the shoulders or
// hips where the skeleton names a left and a right one, else by where the feet point from the shins.
double front_azimuth(const Mesh& mesh, const Skeleton& skeleton, const std::optional<Pose>& pose);

struct Crop {
    int left = 0, top = 0, width = 0, height = 0;  // pixels
};
// The part that was drawn on, with a margin of 2 % of its height; all where nothing was.
Crop covered_part(const Picture& picture);
Picture cropped(const Picture& picture, const Crop& crop);
// Half the size: each pixel the mean of four. An odd last row or column is left out.
Picture halved(const Picture& picture);

// How a row of tiles is drawn.
struct TileView {
    double azimuth = 0;
    bool close_up = false;  // head and chest alone
    int height = 480;       // pixels, about
};

// Pictures of the original and of other meshes of the same frame, all cut alike.
Result<std::vector<Picture>> draw_tiles(const std::vector<const Mesh*>& meshes, const TileView& view,
                                        const RenderOptions& options, unsigned threads);

// Writes the pictures as PNG files NAME_0.png, NAME_1.png ... in the folder; one label each.
Result<std::vector<Tile>> save_tiles(const std::vector<Picture>& pictures, const std::vector<std::string>& labels,
                                     const std::filesystem::path& folder, const std::string& name);

}  // namespace htvm::lab
