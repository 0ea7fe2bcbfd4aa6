// What the commands that draw meshes have in common: where the camera stands, how the mesh is drawn, and, for pictures
// that people look at, their size, background and edges.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/render.h"
#include "metrics/smooth_picture.h"
#include "sequences.h"

namespace CLI {
class App;
}

namespace htvm::app {

// --width, --height, --azimuth, --elevation, --orthographic, and --up, whose default is described by up_default.
void add_camera_options(CLI::App& command, ViewOptions& views, const std::string& up_default);

struct ShadingOptions {
    std::optional<Shading> shading;  // none: as the command says
    bool grey = false;
};
// --shading, whose default is described by shading_default, and --grey.
void add_shading_options(CLI::App& command, ShadingOptions& options, const std::string& shading_default);

// ---- Pictures for people --------------------------------------------------------------------------------------------

struct PictureOptions {
    std::vector<std::string> inputs;  // as open_meshes() takes them
    ViewOptions views;
    double zoom = 1;                // times as large as where the whole is in the picture
    std::optional<Point3> look_at;  // mm, what is in the picture's middle; none: the box's
    ShadingOptions shading;
    std::optional<Colour> background = Colour{255, 255, 255};  // none: transparent
    int samples = 3;                                           // across a pixel
    DecoderOptions limits;
    TextureOptions texture;
    unsigned threads = 0;
};
// The positional argument: what is drawn.
void add_picture_input(CLI::App& command, PictureOptions& options);
// All of the above, --zoom, --look-at, --field-of-view, --background, --samples, --threads and the decoder's limits.
void add_picture_options(CLI::App& command, PictureOptions& options);

// How this mesh is drawn: coloured ones unlit unless told otherwise, as captured colours contain the light.
RenderOptions render_options(const PictureOptions& options, const TexturedMesh& mesh);

// Where the head is, as far as the first mesh of a sequence tells it: z if it is longer along that than along y, else
// y.
UpAxis likely_up(const Mesh& first);

// The views with an axis that is up: the option's, else the source's, else y or z, along which the first mesh is
// longer; and with azimuths from the front, as the source says it, or as the first mesh faces if it is seen from one
// side only.
ViewOptions subject_views(const PictureOptions& options, const MeshSource& source, const Mesh& first);

// The camera with the zoom and the place to look at; box: the one that it looks at without.
Camera closer(const Camera& camera, const Box& box, const PictureOptions& options);

// As many samples as the options say, or as the largest canvas has room for.
int samples_of(const PictureOptions& options);

}  // namespace htvm::app
