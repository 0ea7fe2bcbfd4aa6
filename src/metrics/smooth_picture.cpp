#include "metrics/smooth_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "core/parallel.h"
#include "core/srgb.h"
#include "metrics/mesh_measures.h"

namespace htvm {

using namespace internal;

namespace {

// The pixel (x, y): the mean of the covered samples' light, and their share.
std::array<std::uint8_t, 4> reduced(const Picture& large, std::size_t x, std::size_t y, std::size_t samples) {
    std::array<float, 3> light{};
    std::size_t covered = 0;
    for (std::size_t j = y * samples; j < (y + 1) * samples; ++j)
        for (std::size_t i = x * samples; i < (x + 1) * samples; ++i) {
            const std::size_t at = j * static_cast<std::size_t>(large.width) + i;
            if (!large.covered[at]) continue;
            ++covered;
            for (std::size_t c = 0; c < 3; ++c) light[c] += light_of(large.rgb[3 * at + c]);
        }
    if (covered == 0) return {};
    std::array<std::uint8_t, 4> out{};
    for (std::size_t c = 0; c < 3; ++c) out[c] = level_of(light[c] / static_cast<float>(covered));
    const std::size_t all = samples * samples;
    out[3] = static_cast<std::uint8_t>((255 * covered + all / 2) / all);
    return out;
}

}  // namespace

Camera zoomed_to(const Mesh& mesh, const Camera& camera, double margin) {
    double across = 0, upright = 0;  // shares of half of the picture that the mesh takes with `camera`
    const auto shown = shown_vertices(mesh);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        if (!shown[v]) continue;
        const Point3 d = to_point(mesh.positions[v]) - camera.position;
        const double depth = -dot(d, camera.backward);
        const double scale = camera.orthographic ? camera.scale : depth > 0 ? camera.scale / depth : 0;
        across = std::max(across, std::abs(dot(d, camera.right)) * scale / (camera.width / 2.0));
        upright = std::max(upright, std::abs(dot(d, camera.up)) * scale / (camera.height / 2.0));
    }
    Camera out = camera;
    const double largest = std::max(across, upright);
    if (largest > 0) out.scale *= (1 - 2 * margin) / largest;
    return out;
}

SmoothPicture draw_smoothly(const DrawableMesh& drawable, const Camera& camera, int samples, Canvas& canvas,
                            Threads threads) {
    Camera large = camera;
    large.width *= samples;
    large.height *= samples;
    large.scale *= samples;
    draw(drawable, large, canvas, threads);
    const auto width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
    SmoothPicture out{camera.width, camera.height, std::vector<std::uint8_t>(4 * width * height)};
    parallel_for(height, threads, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y)
            for (std::size_t x = 0; x < width; ++x) {
                const auto pixel = reduced(canvas.picture, x, y, static_cast<std::size_t>(samples));
                std::memcpy(&out.rgba[4 * (y * width + x)], pixel.data(), 4);
            }
    });
    return out;
}

std::vector<std::uint8_t> on_background(const SmoothPicture& picture, const Colour& background) {
    const std::size_t pixels = picture.rgba.size() / 4;
    std::vector<std::uint8_t> out(3 * pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        const auto* rgba = &picture.rgba[4 * p];
        const float share = static_cast<float>(rgba[3]) / 255;
        for (std::size_t c = 0; c < 3; ++c)
            out[3 * p + c] = rgba[3] == 0 ? background[c]
                             : rgba[3] == 255
                                 ? rgba[c]
                                 : level_of(share * light_of(rgba[c]) + (1 - share) * light_of(background[c]));
    }
    return out;
}

}  // namespace htvm
