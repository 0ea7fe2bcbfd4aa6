#include "synth/texture.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "synth/appearance.h"
#include "synth/body.h"
#include "synth/choreography.h"
#include "synth/extract.h"
#include "synth/random.h"

namespace htvm {

using namespace internal;
namespace {

using namespace synth;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int gutter = 4;  // pixels around each chart that go on with its colours

// The streams of random numbers of a layout and of a frame's image.
enum Stream : std::uint64_t { layout_stream = 0x7e57, axes_stream, order_stream, exposure_stream, noise_stream };

Vector3d to_eigen(const Vector3f& p) {
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

// ---- The layout: where every place of the body is in the image ------------------------------------------------------

// A side of a part, seen from outside along one of six directions.
constexpr std::size_t sides = 6, chart_count = scene_part_count * sides;

struct Chart {
    Vector3d across, upright;  // along the image's axes, in rest coordinates
    Vector2d low, high;        // what it shows, mm along these
    Vector2d corner;           // of `low` in the image, pixels from the top left
};

struct Layout {
    Eigen::Matrix3d axes;  // columns: the directions that charts are seen from
    std::vector<Chart> charts;
    double scale = 0;  // pixels per mm
};

// Points on the surface of one part, alone and at rest.
const std::vector<Vector3d>& points_of(std::size_t part) {
    static const std::array<std::vector<Vector3d>, scene_part_count> all = [] {
        std::array<std::vector<Vector3d>, scene_part_count> out;
        for (std::size_t p = 0; p < scene_part_count; ++p) {
            PosedScene scene = rest_scene();
            scene.present = part_bit(p);
            if (figure_of(p) == Figure::chair || figure_of(p) == Figure::ball)  // at the origin
                scene.landmarks = {{-200, 0, -300}, {200, 900, 200}};
            Grid grid;
            grid.cell = 20;
            out[p] = extract_surface(scene, grid, {}).positions;
        }
        return out;
    }();
    return all[part];
}

PartSet shown_parts(const SynthOptions& options) {
    const bool everyday = options.motion == SynthMotion::everyday;
    PartSet out = 0;
    for (std::size_t p = 0; p < scene_part_count; ++p) {
        const bool other = figure_of(p) == Figure::other_person;
        if (everyday || p < part_count || (other && options.people > 1)) out |= part_bit(p);
    }
    return out;
}

// Places the charts in rows, the highest first but for some disorder. False if they do not fit.
bool pack(std::vector<Chart*>& order, double scale, int size) {
    double x = 0, y = 0, row = 0;
    for (Chart* chart : order) {
        const Vector2d pixels = scale * (chart->high - chart->low) + Vector2d::Constant(2 * gutter + 1);
        if (x + pixels.x() > size) {
            x = 0;
            y += std::exchange(row, 0);
        }
        if (x + pixels.x() > size || y + pixels.y() > size) return false;
        chart->corner = Vector2d(x + gutter, y + gutter);
        x += std::ceil(pixels.x());
        row = std::max(row, std::ceil(pixels.y()));
    }
    return true;
}

Layout make_layout(const SynthOptions& options, int size, int number) {
    const RandomKey key =
        derive_key(derive_key(RandomKey{mix_bits(options.seed)}, layout_stream), static_cast<std::uint64_t>(number));
    const RandomKey axes_key = derive_key(key, axes_stream), order_key = derive_key(key, order_stream);
    Layout out;
    // Not far from the axes of the T-pose, along which most of its parts lie.
    const Vector3d turn(random_gaussian(axes_key, 0), random_gaussian(axes_key, 1), random_gaussian(axes_key, 2));
    const double angle = 0.2 * random_uniform(axes_key, 3);
    out.axes = Eigen::AngleAxisd(angle, turn.normalized()).toRotationMatrix();
    out.charts.resize(chart_count);
    std::vector<std::pair<double, Chart*>> ranked;
    for (std::size_t part = 0; part < scene_part_count; ++part) {
        if (!(shown_parts(options) & part_bit(part))) continue;
        for (std::size_t side = 0; side < sides; ++side) {
            const std::size_t index = part * sides + side;
            Chart& chart = out.charts[index];
            const auto axis = static_cast<Eigen::Index>(side / 2);
            chart.across = out.axes.col((axis + 1) % 3);
            chart.upright = out.axes.col((axis + 2) % 3);
            // A quarter turn keeps what lies upright from being high.
            constexpr double margin = 30;  // mm, for the skin that a bent joint pulls over from the next part
            const auto measure = [&] {
                chart.low.setConstant(std::numeric_limits<double>::max());
                chart.high.setConstant(std::numeric_limits<double>::lowest());
                for (const Vector3d& point : points_of(part)) {
                    const Vector2d place(chart.across.dot(point), chart.upright.dot(point));
                    chart.low = chart.low.cwiseMin(place);
                    chart.high = chart.high.cwiseMax(place);
                }
                chart.low.array() -= margin;
                chart.high.array() += margin;
            };
            measure();
            if (chart.high.y() - chart.low.y() > chart.high.x() - chart.low.x()) {
                std::swap(chart.across, chart.upright);
                measure();
            }
            if (random_uniform(order_key, 2 * index) < 0.5) {
                chart.across = -chart.across;
                measure();
            }
            const double disorder = 0.7 + 0.3 * random_uniform(order_key, 2 * index + 1);
            ranked.emplace_back(-disorder * (chart.high.y() - chart.low.y()), &chart);
        }
    }
    std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Chart*> order;
    for (const auto& [rank, chart] : ranked) order.push_back(chart);
    double fits = 0, too_large = 10;
    for (int round = 0; round < 30; ++round) {
        const double scale = (fits + too_large) / 2;
        (pack(order, scale, size) ? fits : too_large) = scale;
    }
    out.scale = fits;
    pack(order, fits, size);
    return out;
}

Vector2d pixel_of(const Layout& layout, const Chart& chart, const Vector3d& rest) {
    const Vector2d place(chart.across.dot(rest), chart.upright.dot(rest));
    return chart.corner + layout.scale * (place.cwiseMax(chart.low).cwiseMin(chart.high) - chart.low);
}

// ---- The mesh on it -------------------------------------------------------------------------------------------------

// A triangle in the image.
struct Patch {
    std::array<Vector2d, 3> pixels;
    std::array<Vector3d, 3> rest;
    Figure figure = Figure::person;
};

struct Unfolded {
    std::vector<std::size_t> charts;  // of each triangle
    std::vector<Patch> patches;       // likewise
};

Unfolded unfold(const SynthFrame& made, const PosedScene& scene, const Layout& layout, Threads threads) {
    const auto& triangles = made.mesh.triangles;
    std::vector<SurfacePoint> points(made.true_positions.size());
    parallel_for(points.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            points[v] = evaluate_surface(scene, scene.present, to_eigen(made.true_positions[v]));
    });
    Unfolded out;
    out.charts.resize(triangles.size());
    out.patches.resize(triangles.size());
    parallel_for(triangles.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            std::array<Vector3d, 3> corners;
            for (std::size_t c = 0; c < 3; ++c) corners[c] = to_eigen(made.true_positions[triangles[t][c]]);
            const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
            const std::size_t part = evaluate_surface(scene, scene.present, middle).part;
            const PartFrame& frame = scene.parts[part];
            Patch& patch = out.patches[t];
            patch.figure = figure_of(part);
            for (std::size_t c = 0; c < 3; ++c) {
                const SurfacePoint& point = points[triangles[t][c]];
                // Where parts merely touch, a corner may belong to the other one.
                const bool hangs_together = (joined_parts(part) & part_bit(point.part)) != 0;
                patch.rest[c] =
                    hangs_together
                        ? point.rest
                        : Vector3d(frame.rotation.transpose() * (corners[c] - frame.pivot) + frame.rest_pivot);
            }
            const Vector3d normal = (patch.rest[1] - patch.rest[0]).cross(patch.rest[2] - patch.rest[0]);
            const Vector3d along = layout.axes.transpose() * normal;
            Eigen::Index axis = 0;
            along.cwiseAbs().maxCoeff(&axis);
            out.charts[t] = part * sides + 2 * static_cast<std::size_t>(axis) + (along[axis] < 0 ? 1 : 0);
            for (std::size_t c = 0; c < 3; ++c)
                patch.pixels[c] = pixel_of(layout, layout.charts[out.charts[t]], patch.rest[c]);
        }
    });
    return out;
}

void give_texcoords(const SynthFrame& made, const Unfolded& unfolded, int size, SynthTexture& out) {
    constexpr std::size_t none = chart_count;
    Mesh& mesh = out.mesh;
    mesh.positions = made.mesh.positions;
    mesh.normals = made.mesh.normals;
    mesh.texcoords.resize(mesh.positions.size());
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) out.vertices.push_back(v);
    std::vector<std::size_t> chart_of(mesh.positions.size(), none);
    std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> others;
    for (std::size_t t = 0; t < made.mesh.triangles.size(); ++t) {
        Triangle triangle = made.mesh.triangles[t];
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t v = triangle[c];
            const std::size_t chart = unfolded.charts[t];
            const Vector2d place = unfolded.patches[t].pixels[c] / size;
            const Vector2f texcoord{static_cast<float>(place.x()), static_cast<float>(1 - place.y())};
            if (chart_of[v] == none) {
                chart_of[v] = chart;
                mesh.texcoords[v] = texcoord;
            }
            if (chart_of[v] == chart) continue;
            const auto [at, is_new] =
                others.emplace(std::pair(v, chart), static_cast<std::uint32_t>(out.vertices.size()));
            triangle[c] = at->second;
            if (!is_new) continue;
            out.vertices.push_back(v);
            mesh.positions.push_back(made.mesh.positions[v]);
            if (!mesh.normals.empty()) mesh.normals.push_back(made.mesh.normals[v]);
            mesh.texcoords.push_back(texcoord);
        }
        mesh.triangles.push_back(triangle);
    }
}

// ---- The image ------------------------------------------------------------------------------------------------------

// Along b - a and c - a from a, or nothing for a patch without an area.
struct Shares {
    Vector2d origin, first, second;
    bool is_flat = true;
    explicit Shares(const Patch& patch) : origin(patch.pixels[0]) {
        const Vector2d b = patch.pixels[1] - origin, c = patch.pixels[2] - origin;
        const double area = b.x() * c.y() - b.y() * c.x();
        is_flat = std::abs(area) < 1e-12;
        if (is_flat) return;
        first = Vector2d(c.y(), -c.x()) / area;
        second = Vector2d(-b.y(), b.x()) / area;
    }
    std::array<double, 3> at(const Vector2d& pixel) const {
        const double x = first.dot(pixel - origin), y = second.dot(pixel - origin);
        return {1 - x - y, x, y};
    }
};

// The mean of four places of a pixel.
Vector3d colour_of(const Patch& patch, const Shares& shares, const Vector2d& middle) {
    Vector3d sum = Vector3d::Zero();
    for (const double dx : {-0.25, 0.25})
        for (const double dy : {-0.25, 0.25}) {
            const auto s = shares.at(middle + Vector2d(dx, dy));
            const Vector3d rest = s[0] * patch.rest[0] + s[1] * patch.rest[1] + s[2] * patch.rest[2];
            const Colour colour = surface_colour(patch.figure, rest);
            sum += Vector3d(colour[0], colour[1], colour[2]);
        }
    return sum / 4;
}

// Draws the patches; `drawn` says which pixels they cover.
void draw(const std::vector<Patch>& patches, Image& image, std::vector<std::uint8_t>& drawn, Threads threads) {
    const auto size = static_cast<std::size_t>(image.width);
    // Every thread draws all triangles, in the same order, into rows of its own.
    parallel_for(size, threads, 64, [&](std::size_t begin, std::size_t end) {
        for (const Patch& patch : patches) {
            Vector2d low = patch.pixels[0], high = low;
            for (const Vector2d& corner : patch.pixels) {
                low = low.cwiseMin(corner);
                high = high.cwiseMax(corner);
            }
            const auto from = [](double x) { return static_cast<std::size_t>(std::max(0.0, std::ceil(x - 0.5))); };
            const Shares shares(patch);
            if (shares.is_flat) continue;
            for (std::size_t y = std::max(begin, from(low.y())); y < end && static_cast<double>(y) + 0.5 <= high.y();
                 ++y)
                for (std::size_t x = from(low.x()); x < size && static_cast<double>(x) + 0.5 <= high.x(); ++x) {
                    const Vector2d middle(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
                    const auto inside = shares.at(middle);
                    if (std::min({inside[0], inside[1], inside[2]}) < -1e-9) continue;
                    const Vector3d colour = colour_of(patch, shares, middle);
                    drawn[y * size + x] = 1;
                    for (std::size_t c = 0; c < 3; ++c)
                        image.rgb[3 * (y * size + x) + c] =
                            static_cast<std::uint8_t>(std::lround(colour[static_cast<Eigen::Index>(c)]));
                }
        }
    });
}

// Charts go on beyond their border, so that what is sampled there does not mix with the background.
void fill_gutters(Image& image, std::vector<std::uint8_t>& drawn) {
    const int size = image.width;
    for (int round = 0; round < gutter; ++round) {
        const auto before = drawn;
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const auto at =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x);
                if (before[at]) continue;
                std::array<int, 3> sum{};
                int count = 0;
                for (int j = std::max(y - 1, 0); j <= std::min(y + 1, size - 1); ++j)
                    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, size - 1); ++i) {
                        const auto beside =
                            static_cast<std::size_t>(j) * static_cast<std::size_t>(size) + static_cast<std::size_t>(i);
                        if (!before[beside]) continue;
                        ++count;
                        for (std::size_t c = 0; c < 3; ++c) sum[c] += image.rgb[3 * beside + c];
                    }
                if (count == 0) continue;
                drawn[at] = 1;
                for (std::size_t c = 0; c < 3; ++c) image.rgb[3 * at + c] = static_cast<std::uint8_t>(sum[c] / count);
            }
    }
}

// A nearly normal number of variance 1: the sum of eight bytes, scaled.
double quick_gaussian(RandomKey key, std::uint64_t index) {
    std::uint64_t bits = random_bits(key, index);
    int sum = 0;
    for (int i = 0; i < 8; ++i, bits >>= 8) sum += static_cast<int>(bits & 255);
    constexpr double mean = 8 * 127.5, deviation = 209.02;  // the square root of 8 (256^2 - 1) / 12
    return (sum - mean) / deviation;
}

// The exposure of all channels drifts over seconds and jumps a little from frame to frame; the white balance drifts.
std::array<double, 3> gain_at(const SynthOptions& options, const SynthTextureOptions& texture, double seconds,
                              RandomKey frame_key) {
    const RandomKey key = derive_key(RandomKey{mix_bits(options.seed)}, exposure_stream);
    const auto wave = [&](std::uint64_t index, double period) {
        return std::sin(2 * std::numbers::pi * (seconds / period + random_uniform(key, index)));
    };
    const double share = texture.exposure / 100;
    const double all = share * wave(0, 3.1) + 0.2 * share * random_gaussian(derive_key(frame_key, exposure_stream), 0);
    return {1 + all + 0.2 * share * wave(1, 4.3), 1 + all, 1 + all + 0.2 * share * wave(2, 5.7)};
}

Image as_seen(const Image& exact, const std::vector<std::uint8_t>& drawn, const std::array<double, 3>& gain,
              double noise, RandomKey key, Threads threads) {
    Image out = exact;
    parallel_for(drawn.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            if (!drawn[p]) continue;
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t at = 3 * p + c;
                const double value = gain[c] * exact.rgb[at] + noise * quick_gaussian(key, at);
                out.rgb[at] = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
            }
        }
    });
    return out;
}

}  // namespace

Result<void> check_texture_options(const SynthTextureOptions& options) {
    if (options.size < 64 || options.size > largest_image_side)
        return fail(ErrorKind::bad_input, "a synthetic texture can have 64 to " + std::to_string(largest_image_side) +
                                              " pixels along a side, not " + std::to_string(options.size));
    if (!(options.noise >= 0 && options.noise <= 100))
        return fail(ErrorKind::bad_input, "the noise of a texture must be between 0 and 100 levels");
    if (!(options.exposure >= 0 && options.exposure <= 50))
        return fail(ErrorKind::bad_input, "the exposure of a texture can change by 0 to 50 percent");
    return {};
}

SynthTexture synth_texture(const SynthOptions& options, const SynthTextureOptions& texture, const SynthFrame& made,
                           int frame, Threads threads) {
    const double seconds = std::max(0, frame) / options.fps;
    SynthTexture out;
    out.layout = static_cast<int>(std::floor(seconds + 1e-9));
    const Layout layout = make_layout(options, texture.size, out.layout);
    const PosedScene scene = pose_scene(options.motion, options.people, options.seed, seconds);
    const Unfolded unfolded = unfold(made, scene, layout, threads);
    give_texcoords(made, unfolded, texture.size, out);
    const auto pixels = static_cast<std::size_t>(texture.size) * static_cast<std::size_t>(texture.size);
    out.exact = {texture.size, texture.size, std::vector<std::uint8_t>(3 * pixels)};
    std::vector<std::uint8_t> drawn(pixels);
    draw(unfolded.patches, out.exact, drawn, threads);
    fill_gutters(out.exact, drawn);
    const RandomKey key = derive_key(derive_key(RandomKey{mix_bits(options.seed)}, noise_stream),
                                     static_cast<std::uint64_t>(static_cast<std::uint32_t>(frame)));
    out.gain = gain_at(options, texture, seconds, key);
    out.image = as_seen(out.exact, drawn, out.gain, texture.noise, key, threads);
    return out;
}

}  // namespace htvm
