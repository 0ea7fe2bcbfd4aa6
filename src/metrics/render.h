// Pictures of a mesh from cameras around it, drawn in software: this needs no graphics card or display, and gives the
// same bits for any number of threads. For the picture metric M3 (paper, section VI-A3) and for viewing.
//
// Perspective or orthographic projection; triangles are drawn from both sides with a depth buffer. A pixel belongs to a
// triangle if its centre lies inside, on a 1/256 pixel grid, with the top-left rule for edges: triangles that share an
// edge leave no gap and cover no pixel twice. Not drawn: triangles with a corner behind the camera, or more than 2^20
// pixels off the picture; isolated vertices.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

// Cameras evenly spaced around the body, on a circle about the vertical axis through the centre of the box.
struct ViewOptions {
    int views = 10;                   // 1..1000 cameras
    int width = 1280, height = 1024;  // pixels, 1..16384
    UpAxis up = UpAxis::plus_y;       // the direction of the body's head; unknown is y
    double first_azimuth = 0;         // degrees, for the first camera; 0 looks along -z where y is up
    double elevation = 0;             // degrees by which the cameras look down, -80..80
    double field_of_view = 30;        // vertical, degrees, 1..120; not used for orthographic cameras
    bool orthographic = false;        // parallel projection
    double margin = 0.05;             // share of the picture to leave free on each side, 0..0.4
};

struct Camera {
    Point3 position;             // mm
    Point3 right, up, backward;  // unit vectors; the camera looks along -backward
    int width = 0, height = 0;   // pixels
    double scale = 1;            // pixels per unit of x / depth, or per mm if orthographic
    bool orthographic = false;
};

// The cameras of `options`, placed such that the box lies entirely inside every picture; all at the same distance and
// scale. An empty box, or one without extent, is treated as if it were 1 mm large. bad_input for options out of range.
Result<std::vector<Camera>> cameras_round(const Box& box, const ViewOptions& options);

enum class Shading {
    flat,    // one normal per triangle
    smooth,  // normals interpolated between the vertices (welded_normals, so texture seams do not show)
    unlit,   // the colour without shading
};

struct RenderOptions {
    Shading shading = Shading::smooth;
    bool colours = true;  // draw the mesh's texture, else its colours, if it has one; false: draw the material
    Colour material{200, 200, 200};  // for meshes drawn without colours
    Colour background{255, 255, 255};
};

struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;      // 3 bytes per pixel, row by row from the top left
    std::vector<std::uint8_t> covered;  // one byte per pixel: 1 if the mesh was drawn there (the foreground), else 0
};

// A mesh to draw, with its texture if it has one, and the tints that multiply that; all are lent.
struct ShownMesh {
    const Mesh* mesh;
    const Image* texture = nullptr;
    const std::vector<Colour>* tints = nullptr;  // null: none
    ShownMesh(const Mesh& shown) : mesh(&shown) {}
    ShownMesh(const TexturedMesh& shown) : mesh(&shown.mesh), texture(shown.texture.get()) {
        if (!shown.tints.empty()) tints = &shown.tints;
    }
    bool has_colours() const { return texture || !mesh->colours.empty(); }
};

// A mesh prepared for drawing from several cameras. The mesh and its texture must outlive it.
//
// A texture is sampled at the place that each pixel's centre sees, linearly between texels. Where a pixel sees several,
// a smaller image stands in whose texels are nearest to a pixel's size, by triangle: else a picture would show
// whichever texel it meets, and neighbouring pictures others.
struct DrawableMesh {
    const Mesh* mesh = nullptr;
    RenderOptions options;
    std::vector<Vector3f> normals;                  // one per vertex, if smooth shading needs them
    std::optional<internal::ImagePyramid> texture;  // if it is drawn
    const std::vector<Colour>* tints = nullptr;     // of the vertices, likewise
};
DrawableMesh make_drawable(const ShownMesh& shown, const RenderOptions& options = {});

// Everything that drawing needs besides the picture, kept so that the next picture of the same size needs no
// allocation.
struct Canvas {
    struct ProjectedVertex {
        std::int32_t x = 0, y = 0;  // 1/256 pixel
        bool drawable = false;
        double nearness = 0;  // larger is nearer; linear over the picture plane
    };
    Picture picture;
    std::vector<float> nearness;  // one per pixel
    std::vector<ProjectedVertex> vertices;
};

// Draws into canvas.picture, replacing its contents.
void draw(const DrawableMesh& drawable, const Camera& camera, Canvas& canvas, internal::Threads threads = {});

// One picture of a mesh.
Picture render(const ShownMesh& shown, const Camera& camera, const RenderOptions& options = {},
               internal::Threads threads = {});

// Puts pictures side by side, from the left; rows below a lower picture stay white.
Picture side_by_side(const std::vector<Picture>& pictures);

// Writes an 8-bit RGB PNG file. bad_input if that fails.
Result<void> write_png(const Picture& picture, const std::string& path);

}  // namespace htvm
