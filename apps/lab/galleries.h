// Decoded frames drawn side by side (figures 8, 9, 14, 15 and 19).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "coders.h"
#include "figures.h"
#include "metrics/render.h"
#include "page.h"
#include "sweep.h"

namespace htvm::lab {

// A coder with one setting, whose decoded frames are wanted.
struct PictureJob {
    CoderUnderTest coder;
    double geometry_step = 2, colour_step = 6;
    double rate = 0;                  // bpvf of the whole sequence with these steps, for the label
    std::vector<std::size_t> frames;  // wanted, ascending
    std::size_t first = 0;            // frame at which to start coding
};

// The decoded meshes of the job's frames. Coders that code every frame by itself skip frames that are not wanted.
Result<std::vector<Mesh>> decode_frames(const SourceFrames& source, const PictureJob& job, unsigned threads);

// The angle from which the body is seen from the front, in degrees (ViewOptions::first_azimuth; y up): by the shoulders
// or hips if the skeleton names a left and a right one, else by the direction from the shins to the toes.
double front_azimuth(const Mesh& mesh, const Skeleton& skeleton, const std::optional<Pose>& pose);

struct Crop {
    int left = 0, top = 0, width = 0, height = 0;  // pixels
};
// The part of the picture that was drawn on, with a margin of 2 % of its height; everything if nothing was.
Crop covered_part(const Picture& picture);
Picture cropped(const Picture& picture, const Crop& crop);
// Half the size: each pixel is the mean of four. An odd last row or column is left out.
Picture halved(const Picture& picture);

// How a row of tiles is drawn.
struct TileView {
    double azimuth = 0;
    bool close_up = false;  // head and chest only
    int height = 480;       // pixels, approximate
};

// Pictures of the original and of other meshes of the same frame, all cropped in the same way.
Result<std::vector<Picture>> draw_tiles(const std::vector<const Mesh*>& meshes, const TileView& view,
                                        const RenderOptions& options, unsigned threads);

// Writes the pictures as PNG files NAME_0.png, NAME_1.png ... in the folder; one label for each.
Result<std::vector<Tile>> save_tiles(const std::vector<Picture>& pictures, const std::vector<std::string>& labels,
                                     const std::filesystem::path& folder, const std::string& name);

// ---- Figures 8, 9, 14 and 15 ----------------------------------------------------------------------------------------

struct GalleryOptions {
    std::filesystem::path folder;   // for the PNG files
    std::optional<double> azimuth;  // degrees; none: from the front, as far as it can be determined
    int key_interval = 30;
    double colour_step = 6;
    unsigned threads = 1;
};

struct Gallery {
    std::vector<Figure> figures;
    std::vector<Tile> opening;  // original, the paper's coder, TFAN; may be empty
    std::string opening_caption;
};

// Those of figures 8, 9, 14 and 15 that are wanted. Rates are taken from the points of the findings. The folder also
// gets first_results.png, which shows the tiles of the opening side by side.
Result<Gallery> picture_figures(const SourceFrames& source, const Findings& findings, const std::set<int>& wanted,
                                const GalleryOptions& options);

// ---- Figure 19: motion-based coding at rising rates, and the seam before and after zippering ------------------------

// Figure 19 and, numbered 19b, the zippering, if wanted; fills findings.seams. The folder also gets zippering.png,
// which shows the tiles of 19b side by side.
Result<std::vector<Figure>> motion_pictures(const SourceFrames& source, const ExperimentPlan& plan,
                                            const std::set<int>& wanted, const GalleryOptions& options,
                                            Findings& findings);

// What zippering does to open edges, cracks and flaps, frame by frame; nothing without figure 19.
std::optional<Table> seam_table(const Findings& findings);

// The mesh with three vertices per triangle and uniform colours: one for the first coded_triangles, one for those up to
// kept_end (animated), and one for the rest (stitches).
Mesh tinted(const Mesh& mesh, std::size_t coded_triangles, std::size_t kept_end);

// The middle and the direction of a stretch of seam: the stitch with the most other stitches near it. Nothing without
// stitches.
struct SeamSpot {
    Point3 centre, normal;
};
std::optional<SeamSpot> busiest_seam(const SeamStages& stages, double radius);

}  // namespace htvm::lab
