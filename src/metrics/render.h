// Pictures of a mesh from cameras round it, drawn in software: no graphics card or display, and the same bits for any
// number of threads. For the picture metric M3 (paper, section VI-A3) and for people to look at.
//
// Perspective or orthographic projection; triangles are drawn from both sides with a depth buffer. A pixel belongs to a
// triangle if its centre lies inside, on a 1/256 pixel grid, edges by the top-left rule: triangles that share an edge
// leave no gap and cover no pixel twice. Not drawn: triangles with a corner behind the camera, or more than 2^20 pixels
// off the picture; isolated vertices.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

enum class UpAxis { plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };

// Cameras evenly round the body, on a circle about the vertical axis through the box's centre.
struct ViewOptions {
    int views = 10;                   // 1..1000 cameras
    int width = 1280, height = 1024;  // pixels, 1..16384
    UpAxis up = UpAxis::plus_y;       // which way the body's head is
    double first_azimuth = 0;         // degrees of the first camera; 0 looks along -z where y is up
    double elevation = 0;             // degrees that the cameras look down, -80..80
    double field_of_view = 30;        // vertical, degrees, 1..120; not for orthographic cameras
    bool orthographic = false;        // parallel projection
    double margin = 0.05;             // part of the picture left free on each side, 0..0.4
};

struct Camera {
    Point3 position;             // mm
    Point3 right, up, backward;  // unit vectors; the camera looks along -backward
    int width = 0, height = 0;   // pixels
    double scale = 1;            // pixels per unit of x / depth, or per mm where orthographic
    bool orthographic = false;
};

// The cameras of `options` such that the box lies wholly inside every picture; all at the same distance and scale.
// An empty box or one without extent is looked at as if it were 1 mm large. bad_input for options out of range.
Result<std::vector<Camera>> cameras_round(const Box& box, const ViewOptions& options);

enum class Shading {
    flat,    // one normal a triangle
    smooth,  // normals interpolated between the vertices (welded_normals, so texture seams do not show)
    unlit,   // the colour alone
};

struct RenderOptions {
    Shading shading = Shading::smooth;
    bool colours = true;             // the mesh's colours where it has some; false: the material
    Colour material{200, 200, 200};  // of meshes drawn without colours
    Colour background{255, 255, 255};
};

struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;      // 3 bytes a pixel, row by row from the top left
    std::vector<std::uint8_t> covered;  // one byte a pixel: 1 where the mesh was drawn (the foreground), else 0
};

// A mesh made ready to be drawn from several cameras. The mesh must outlive it.
struct DrawableMesh {
    const Mesh* mesh = nullptr;
    RenderOptions options;
    std::vector<Vector3f> normals;  // one per vertex, where smooth shading needs them
};
DrawableMesh make_drawable(const Mesh& mesh, const RenderOptions& options = {});

// What drawing needs besides the picture, kept so that the next picture of the same size allocates nothing.
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

// Draws into canvas.picture, whatever the canvas held before.
void draw(const DrawableMesh& drawable, const Camera& camera, Canvas& canvas, internal::Threads threads = {});

// One picture of a mesh.
Picture render(const Mesh& mesh, const Camera& camera, const RenderOptions& options = {},
               internal::Threads threads = {});

// Pictures of the same height side by side, from the left; rows below a lower picture stay white.
Picture side_by_side(const std::vector<Picture>& pictures);

// Writes an 8-bit RGB PNG file. bad_input if that fails.
Result<void> write_png(const Picture& picture, const std::string& path);

}  // namespace htvm
