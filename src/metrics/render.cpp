#include "metrics/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/parallel.h"
#include "core/srgb.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::int32_t subpixels = 256;
constexpr double farthest_pixel = 1 << 20;  // keeps fixed-point coordinates below 2^29 and their products below 2^60

using ProjectedVertex = Canvas::ProjectedVertex;

ProjectedVertex project(const Vector3f& position, const Camera& camera) {
    const Point3 d = to_point(position) - camera.position;
    const double depth = -dot(d, camera.backward);
    ProjectedVertex out;
    if (!(depth > 1e-6)) return out;
    const double scale = camera.orthographic ? camera.scale : camera.scale / depth;
    const double x = camera.width / 2.0 + dot(d, camera.right) * scale;
    const double y = camera.height / 2.0 - dot(d, camera.up) * scale;
    if (!(std::abs(x) < farthest_pixel && std::abs(y) < farthest_pixel)) return out;
    out.x = static_cast<std::int32_t>(std::floor(x * subpixels + 0.5));
    out.y = static_cast<std::int32_t>(std::floor(y * subpixels + 0.5));
    out.nearness = camera.orthographic ? -depth : 1 / depth;
    out.drawable = true;
    return out;
}

// On which side of the directed edge a -> b a point lies: positive inside a triangle whose area is positive.
struct EdgeFunction {
    std::int64_t step_x, step_y, at_origin, bias;
    EdgeFunction(const ProjectedVertex& a, const ProjectedVertex& b)
        : step_x(std::int64_t{a.y} - b.y), step_y(std::int64_t{b.x} - a.x) {
        at_origin = -(step_x * a.x + step_y * a.y);
        // A pixel exactly on an edge belongs to the triangle of which this is a top or left edge (y runs downwards).
        const bool top_left = step_x > 0 || (step_x == 0 && step_y > 0);
        bias = top_left ? 0 : -1;
    }
    std::int64_t at(std::int64_t x, std::int64_t y) const { return at_origin + step_x * x + step_y * y + bias; }
};

using Shade = std::array<float, 3>;

// Light from above the camera's left shoulder. Never black, so that the shading distinguishes all directions.
struct Light {
    Point3 direction;
    explicit Light(const Camera& camera)
        : direction(normalised(camera.backward * 0.8 + camera.up * 0.5 - camera.right * 0.35)) {}
    float intensity(const Point3& normal) const {
        const double s = (1 + dot(normal, direction)) / 2;
        return static_cast<float>(0.2 + 0.3 * s + 0.5 * s * s);
    }
};

// A triangle prepared for drawing: shades of the corners are already lit, unless normals are interpolated.
struct TrianglePaint {
    std::array<Shade, 3> shades;
    std::array<Point3, 3> normals;  // used for smooth shading
    bool smooth = false;
    const ImagePyramid* texture = nullptr;  // its colours are multiplied by the shades
    std::array<Vector2f, 3> texcoords;
    std::size_t level = 0;  // of the texture
    bool tinted = false;
    std::array<Shade, 3> tints;  // light by which the texture's is multiplied
};

// Texels along the side of a pixel, on average over the triangle.
double texels_in_pixel(const ImagePyramid& texture, const std::array<Vector2f, 3>& texcoords, double pixels) {
    const auto& [a, b, c] = texcoords;
    const double area = std::abs(static_cast<double>(b[0] - a[0]) * static_cast<double>(c[1] - a[1]) -
                                 static_cast<double>(c[0] - a[0]) * static_cast<double>(b[1] - a[1]));
    return std::sqrt(area * texture.image().width * texture.image().height / pixels);
}

// pixels: twice the triangle's area in the picture.
TrianglePaint paint_of(const DrawableMesh& drawable, const Triangle& t, bool front_facing, const Light& light,
                       double pixels) {
    const Mesh& mesh = *drawable.mesh;
    const RenderOptions& options = drawable.options;
    const bool coloured = options.colours && !mesh.colours.empty() && !drawable.texture;
    TrianglePaint paint;
    if (drawable.texture) {
        paint.texture = &*drawable.texture;
        paint.texcoords = {mesh.texcoords[t[0]], mesh.texcoords[t[1]], mesh.texcoords[t[2]]};
        paint.level = paint.texture->level_for(texels_in_pixel(*paint.texture, paint.texcoords, pixels));
    }
    paint.tinted = drawable.tints != nullptr;
    for (std::size_t i = 0; i < 3 && paint.tinted; ++i)
        for (std::size_t c = 0; c < 3; ++c) paint.tints[i][c] = light_of((*drawable.tints)[t[i]][c]);
    for (std::size_t i = 0; i < 3; ++i) {
        const Colour& c = coloured ? mesh.colours[t[i]] : options.material;
        if (drawable.texture)
            paint.shades[i] = {1, 1, 1};
        else
            paint.shades[i] = {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
    }
    const double side = front_facing ? 1 : -1;
    if (options.shading == Shading::smooth) {
        paint.smooth = true;
        for (std::size_t i = 0; i < 3; ++i) paint.normals[i] = to_point(drawable.normals[t[i]]) * side;
    } else if (options.shading == Shading::flat) {
        const Point3 a = to_point(mesh.positions[t[0]]);
        const Point3 n = cross(to_point(mesh.positions[t[1]]) - a, to_point(mesh.positions[t[2]]) - a);
        const float lit = light.intensity(normalised(n) * side);
        for (auto& shade : paint.shades)
            for (float& c : shade) c *= lit;
    }
    return paint;
}

std::uint8_t level(float value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

Shade tinted(const Shade& texel, const std::array<Shade, 3>& tints, const std::array<double, 3>& weights) {
    Shade out;
    for (std::size_t c = 0; c < 3; ++c) {
        float tint = 0;
        for (std::size_t i = 0; i < 3; ++i) tint += static_cast<float>(weights[i]) * tints[i][c];
        out[c] = level_of(light_of(level(texel[c])) * tint);
    }
    return out;
}

void paint_pixel(const TrianglePaint& paint, const std::array<double, 3>& weights, const Light& light,
                 std::uint8_t* rgb) {
    float lit = 1;
    if (paint.smooth) {
        const Point3 n = paint.normals[0] * weights[0] + paint.normals[1] * weights[1] + paint.normals[2] * weights[2];
        lit = light.intensity(normalised(n));
    }
    Shade texel{1, 1, 1};
    if (paint.texture) {
        const auto place = [&](std::size_t axis) {
            double sum = 0;
            for (std::size_t i = 0; i < 3; ++i) sum += weights[i] * static_cast<double>(paint.texcoords[i][axis]);
            return static_cast<float>(sum);
        };
        texel = paint.texture->at(place(0), place(1), paint.level);
    }
    if (paint.tinted) texel = tinted(texel, paint.tints, weights);
    for (std::size_t c = 0; c < 3; ++c) {
        float value = 0;
        for (std::size_t i = 0; i < 3; ++i) value += static_cast<float>(weights[i]) * paint.shades[i][c];
        rgb[c] = level(value * lit * texel[c]);
    }
}

// The first pixel, and one past the last, whose centre can lie in [low, high], within [begin, end).
struct PixelRange {
    int begin, end;
};

PixelRange pixels_between(std::int32_t low, std::int32_t high, int begin, int end) {
    // centre of pixel p: p * 256 + 128; the shift rounds down for negative numbers too
    return {std::max(begin, (low - subpixels / 2 + subpixels - 1) >> 8),
            std::min(end, ((high - subpixels / 2) >> 8) + 1)};
}

struct Rows {
    int begin, end;
};

void draw_triangle(const DrawableMesh& drawable, const Triangle& t, const Camera& camera, const Light& light, Rows rows,
                   Canvas& canvas) {
    std::array<std::size_t, 3> order{0, 1, 2};
    std::array<const ProjectedVertex*, 3> v{&canvas.vertices[t[0]], &canvas.vertices[t[1]], &canvas.vertices[t[2]]};
    if (!v[0]->drawable || !v[1]->drawable || !v[2]->drawable) return;
    const auto [low_y, high_y] = std::minmax({v[0]->y, v[1]->y, v[2]->y});
    const PixelRange ys = pixels_between(low_y, high_y, rows.begin, rows.end);
    const auto [low_x, high_x] = std::minmax({v[0]->x, v[1]->x, v[2]->x});
    const PixelRange xs = pixels_between(low_x, high_x, 0, camera.width);
    if (ys.begin >= ys.end || xs.begin >= xs.end) return;
    std::int64_t area =
        std::int64_t{v[1]->x - v[0]->x} * (v[2]->y - v[0]->y) - std::int64_t{v[2]->x - v[0]->x} * (v[1]->y - v[0]->y);
    if (area == 0) return;
    const bool front_facing = area < 0;  // counter-clockwise with y upwards
    if (area < 0) {
        std::swap(v[1], v[2]);
        std::swap(order[1], order[2]);
        area = -area;
    }
    const std::array<EdgeFunction, 3> edges{EdgeFunction(*v[1], *v[2]), EdgeFunction(*v[2], *v[0]),
                                            EdgeFunction(*v[0], *v[1])};
    const double inverse_area = 1.0 / static_cast<double>(area);
    TrianglePaint paint;
    bool painted = false;
    for (int y = ys.begin; y < ys.end; ++y) {
        const std::int64_t centre_x = std::int64_t{xs.begin} * subpixels + subpixels / 2;
        const std::int64_t centre_y = std::int64_t{y} * subpixels + subpixels / 2;
        std::array<std::int64_t, 3> inside;
        for (std::size_t i = 0; i < 3; ++i) inside[i] = edges[i].at(centre_x, centre_y);
        std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + xs.begin;
        for (int x = xs.begin; x < xs.end; ++x, ++pixel) {
            const std::array<std::int64_t, 3> here = inside;
            for (std::size_t i = 0; i < 3; ++i) inside[i] += edges[i].step_x * subpixels;
            if ((here[0] | here[1] | here[2]) < 0) continue;
            std::array<double, 3> part;
            for (std::size_t i = 0; i < 3; ++i)
                part[i] = static_cast<double>(here[i] - edges[i].bias) * inverse_area *
                          (camera.orthographic ? 1 : v[i]->nearness);
            double nearness = part[0] + part[1] + part[2];
            const double normalise = 1 / nearness;
            if (camera.orthographic)
                nearness = part[0] * v[0]->nearness + part[1] * v[1]->nearness + part[2] * v[2]->nearness;
            if (!(static_cast<float>(nearness) > canvas.nearness[pixel])) continue;
            canvas.nearness[pixel] = static_cast<float>(nearness);
            if (!painted)
                paint = paint_of(drawable, t, front_facing, light,
                                 static_cast<double>(area) / (double{subpixels} * subpixels));
            painted = true;
            std::array<double, 3> weights;
            for (std::size_t i = 0; i < 3; ++i) weights[order[i]] = part[i] * normalise;
            canvas.picture.covered[pixel] = 1;
            paint_pixel(paint, weights, light, &canvas.picture.rgb[pixel * 3]);
        }
    }
}

void clear(const Camera& camera, const Colour& background, Canvas& canvas) {
    Picture& picture = canvas.picture;
    picture.width = camera.width;
    picture.height = camera.height;
    const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    picture.covered.assign(pixels, 0);
    canvas.nearness.assign(pixels, -std::numeric_limits<float>::infinity());
    picture.rgb.resize(pixels * 3);
    if (background[0] == background[1] && background[1] == background[2]) {
        std::memset(picture.rgb.data(), background[0], picture.rgb.size());
    } else {
        for (std::size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] = background[i % 3];
    }
}

}  // namespace

DrawableMesh make_drawable(const ShownMesh& shown, const RenderOptions& options) {
    DrawableMesh drawable{shown.mesh, options, {}, {}, nullptr};
    if (options.shading == Shading::smooth) drawable.normals = welded_normals(*shown.mesh);
    if (options.colours && shown.texture && !shown.mesh->texcoords.empty()) drawable.texture.emplace(*shown.texture);
    if (drawable.texture) drawable.tints = shown.tints;
    return drawable;
}

void draw(const DrawableMesh& drawable, const Camera& camera, Canvas& canvas, Threads threads) {
    const Mesh& mesh = *drawable.mesh;
    clear(camera, drawable.options.background, canvas);
    canvas.vertices.resize(mesh.positions.size());
    parallel_for(mesh.positions.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) canvas.vertices[v] = project(mesh.positions[v], camera);
    });
    const Light light(camera);
    // Every thread draws all triangles, in the same order, into rows of its own.
    parallel_for(static_cast<std::size_t>(camera.height), threads, 64, [&](std::size_t begin, std::size_t end) {
        const Rows rows{static_cast<int>(begin), static_cast<int>(end)};
        for (const auto& t : mesh.triangles) draw_triangle(drawable, t, camera, light, rows, canvas);
    });
}

Picture render(const ShownMesh& shown, const Camera& camera, const RenderOptions& options, Threads threads) {
    Canvas canvas;
    draw(make_drawable(shown, options), camera, canvas, threads);
    return std::move(canvas.picture);
}

Picture side_by_side(const std::vector<Picture>& pictures) {
    Picture out;
    for (const auto& p : pictures) {
        out.width += p.width;
        out.height = std::max(out.height, p.height);
    }
    const std::size_t width = static_cast<std::size_t>(out.width);
    out.rgb.assign(width * out.height * 3, 255);
    out.covered.assign(width * out.height, 0);
    std::size_t left = 0;
    for (const auto& p : pictures) {
        const std::size_t own = static_cast<std::size_t>(p.width);
        for (std::size_t y = 0; y < static_cast<std::size_t>(p.height); ++y) {
            std::copy_n(&p.rgb[y * own * 3], own * 3, &out.rgb[(y * width + left) * 3]);
            std::copy_n(&p.covered[y * own], own, &out.covered[y * width + left]);
        }
        left += own;
    }
    return out;
}

}  // namespace htvm
