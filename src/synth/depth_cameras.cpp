#include "synth/depth_cameras.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "core/geometry.h"
#include "core/parallel.h"
#include "core/raster.h"
#include "synth/appearance.h"
#include "synth/body.h"
#include "synth/choreography.h"

namespace htvm {

using namespace internal;
namespace {

using namespace synth;
using Eigen::Vector3d;

constexpr std::uint64_t camera_stream = 0xdeb7;
constexpr int most_cameras = 16, most_vertices = 500000;
constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();

Vector3d to_eigen(const Vector3f& p) {
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Vector3f to_float(const Vector3d& p) {
    return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

PosedScene scene_at(const SynthOptions& options, int frame) {
    const double fps = options.fps >= 0.1 ? std::min(options.fps, 10000.0) : 0.1;
    return pose_scene(options.motion, options.people, options.seed, std::max(0, frame) / fps);
}

// ---- Where the cameras are ------------------------------------------------------------------------------------------

// The middle of where the person goes in each motion.
Vector3d middle_of(SynthMotion motion) {
    constexpr double chest_height = 1200;
    if (motion == SynthMotion::tour) return {1000, chest_height, 0};  // the middle of the circle
    return {motion == SynthMotion::everyday ? 400.0 : 0.0, chest_height, 0};
}

// Square mm of surface that a camera with the sensor's own pixels shows, per square mm at its usual distance.
double shown_area(DepthSensor sensor) { return sensor == DepthSensor::phone ? 0.09e6 : 0.55e6; }

// By how much the image is finer than the sensor's own.
double refinement(const DepthCameraOptions& options, double distance) {
    if (options.vertices <= 0) return 1;
    const DepthSensorModel& model = model_of(options.sensor);
    const double pixel = distance / model.focal;
    const double own = shown_area(options.sensor) / (pixel * pixel);
    return std::sqrt(options.vertices / (std::clamp(options.cameras, 1, most_cameras) * own));
}

// Where the cameras look, and the direction in which the first one is, in the frame.
std::pair<Vector3d, Vector3d> aim(const SynthOptions& options, const DepthCameraOptions& cameras, int frame) {
    if (cameras.sensor == DepthSensor::kinect) return {middle_of(options.motion), Vector3d::UnitZ()};
    const auto joints = scene_at(options, frame).joints;
    constexpr std::size_t head = 0, neck = 1, left_shoulder = 3, right_shoulder = 6;
    Vector3d front = (joints[left_shoulder] - joints[right_shoulder]).cross(Vector3d::UnitY());
    front.y() = 0;
    return {0.5 * (joints[head] + joints[neck]), front.norm() > 1 ? front.normalized() : Vector3d::UnitZ()};
}

Vector3d ray_of(const DepthCamera& camera, double x, double y) {
    return (x - 0.5 * camera.width) / camera.focal * camera.right -
           (y - 0.5 * camera.height) / camera.focal * camera.up - camera.backward;
}

// ---- What they see --------------------------------------------------------------------------------------------------

// Each pixel is looked at in 3 x 3 places, the middle one being its centre.
constexpr int places = 3;

// A rectangle of an image's pixels, and what is nearest in each place: one over its depth, and its triangle.
struct View {
    int left = 0, top = 0, width = 0, height = 0;
    std::vector<float> inverse;  // 1/mm; 0: nothing
    std::vector<std::uint32_t> triangles;
    std::size_t place(int x, int y) const {  // of the rectangle
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(places * width) + static_cast<std::size_t>(x);
    }
};

// A corner as the camera sees it: places from the image's corner, and one over its depth.
struct SeenCorner {
    double x = 0, y = 0, inverse = 0;  // inverse 0: not before the camera
};

std::vector<SeenCorner> corners_before(const DepthCamera& camera, const std::vector<Vector3f>& positions) {
    constexpr double least_depth = 50;  // mm
    std::vector<SeenCorner> corners(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const Vector3d offset = to_eigen(positions[v]) - camera.position;
        const double depth = -camera.backward.dot(offset);
        if (!(depth >= least_depth)) continue;
        const double x = places * (0.5 * camera.width + camera.focal * camera.right.dot(offset) / depth),
                     y = places * (0.5 * camera.height - camera.focal * camera.up.dot(offset) / depth);
        constexpr double farthest = 1 << 20;
        if (std::abs(x) < farthest && std::abs(y) < farthest) corners[v] = {x, y, 1 / depth};
    }
    return corners;
}

// The part of the image that shows anything.
View empty_view(const DepthCamera& camera, const std::vector<SeenCorner>& corners) {
    double left = places * camera.width, right = 0, top = places * camera.height, bottom = 0;
    for (const SeenCorner& corner : corners) {
        if (corner.inverse <= 0) continue;
        left = std::min(left, corner.x);
        right = std::max(right, corner.x);
        top = std::min(top, corner.y);
        bottom = std::max(bottom, corner.y);
    }
    const auto pixel = [](double at, int most) {
        return static_cast<int>(std::clamp(std::floor(at / places), 0.0, static_cast<double>(most)));
    };
    View view;
    view.left = pixel(left, camera.width);
    view.top = pixel(top, camera.height);
    view.width = std::max(0, pixel(right + places, camera.width) - view.left);
    view.height = std::max(0, pixel(bottom + places, camera.height) - view.top);
    const auto count = static_cast<std::size_t>(places * places) * static_cast<std::size_t>(view.width) *
                       static_cast<std::size_t>(view.height);
    view.inverse.assign(count, 0.0F);
    view.triangles.assign(count, nothing);
    return view;
}

// One over the depth is linear in the image. Beyond the corners' own it would only be rounding.
void draw(View& view, std::uint32_t triangle, const std::array<SeenCorner, 3>& c) {
    const double ux = c[1].x - c[0].x, uy = c[1].y - c[0].y, vx = c[2].x - c[0].x, vy = c[2].y - c[0].y;
    const double area = ux * vy - uy * vx;
    if (std::abs(area) < 1e-9) return;
    const double du = c[1].inverse - c[0].inverse, dv = c[2].inverse - c[0].inverse;
    const double by_x = (du * vy - dv * uy) / area, by_y = (dv * ux - du * vx) / area;
    const double low = std::min({c[0].inverse, c[1].inverse, c[2].inverse});
    const double high = std::max({c[0].inverse, c[1].inverse, c[2].inverse});
    const int left = places * view.left, top = places * view.top;
    std::array<RasterPoint, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
        corners[i] = {static_cast<std::int32_t>(std::lround((c[i].x - left) * (1 << raster_bits))),
                      static_cast<std::int32_t>(std::lround((c[i].y - top) * (1 << raster_bits)))};
    for_each_cell(corners, {0, 0, places * view.width, places * view.height}, [&](std::int32_t x, std::int32_t y) {
        const double inverse =
            std::clamp(c[0].inverse + by_x * (left + x + 0.5 - c[0].x) + by_y * (top + y + 0.5 - c[0].y), low, high);
        const std::size_t at = view.place(x, y);
        if (static_cast<float>(inverse) <= view.inverse[at]) return;
        view.inverse[at] = static_cast<float>(inverse);
        view.triangles[at] = triangle;
    });
}

View look(const DepthCamera& camera, const std::vector<Vector3f>& positions, const std::vector<Triangle>& triangles) {
    const auto corners = corners_before(camera, positions);
    View view = empty_view(camera, corners);
    if (view.inverse.empty()) return view;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const std::array<SeenCorner, 3> c = {corners[triangles[t][0]], corners[triangles[t][1]],
                                             corners[triangles[t][2]]};
        if (std::min({c[0].inverse, c[1].inverse, c[2].inverse}) > 0) draw(view, t, c);
    }
    return view;
}

// Which triangles the image shows within the sensor's reach. Those that are too steep to fall on a place of a pixel are
// seen if they face the camera, and their corners belong to others that are.
std::vector<std::uint8_t> seen_triangles(const DepthCamera& camera, const DepthSensorModel& model, const View& view,
                                         const SynthFrame& made) {
    const auto& triangles = made.mesh.triangles;
    std::vector<std::uint8_t> seen(triangles.size()), touched(made.true_positions.size());
    for (std::size_t i = 0; i < view.triangles.size(); ++i)
        if (view.triangles[i] != nothing && view.inverse[i] * model.nearest <= 1 &&
            view.inverse[i] * model.farthest >= 1)
            seen[view.triangles[i]] = 1;
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (seen[t])
            for (const std::uint32_t corner : triangles[t]) touched[corner] = 1;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& [i, j, k] = triangles[t];
        if (seen[t] || !touched[i] || !touched[j] || !touched[k]) continue;
        const Vector3d a = to_eigen(made.true_positions[i]), b = to_eigen(made.true_positions[j]),
                       c = to_eigen(made.true_positions[k]);
        seen[t] = (b - a).cross(c - a).dot(camera.position - a) > 0 ? 1 : 0;
    }
    return seen;
}

// ---- What lies before a pixel ---------------------------------------------------------------------------------------

// The part of a pixel's places that is within `step` of the nearest is the front.
SeenPixel sum_up(const View& view, int x, int y, double step_per_depth) {
    SeenPixel pixel;
    std::array<float, places * places> depths{};
    float nearest = 0;
    for (int j = 0; j < places; ++j)
        for (int i = 0; i < places; ++i) {
            const float inverse = view.inverse[view.place(places * x + i, places * y + j)];
            nearest = std::max(nearest, inverse);
            depths[static_cast<std::size_t>(places * j + i)] = inverse > 0 ? 1 / inverse : 0;
        }
    if (nearest <= 0) return pixel;
    pixel.centre = depths[places * places / 2];
    pixel.front = 1 / nearest;
    const double limit = pixel.front * (1 + step_per_depth);
    int covered = 0, empty = 0;
    float sum = 0;
    for (const float depth : depths) {
        if (depth <= 0)
            ++empty;
        else if (depth <= limit)
            ++covered;
        else
            sum += depth;
    }
    const int behind = places * places - covered - empty;
    pixel.cover = static_cast<float>(covered) / (places * places);
    if (behind > 0) pixel.back = sum / static_cast<float>(behind);
    return pixel;
}

// The triangle at the pixel's centre, or else any of the pixel.
std::uint32_t triangle_in(const View& view, int x, int y) {
    std::uint32_t triangle = view.triangles[view.place(places * x + places / 2, places * y + places / 2)];
    for (int j = 0; j < places; ++j)
        for (int i = 0; i < places && triangle == nothing; ++i)
            triangle = view.triangles[view.place(places * x + i, places * y + j)];
    return triangle;
}

std::vector<SeenPixel> pixels_of(const DepthCamera& camera, const View& view, const SynthFrame& made,
                                 const PosedScene& scene) {
    // Depths further apart than a surface makes them which is turned away by 80 degrees are on either side of an edge.
    const double step_per_depth = 6 / camera.focal;
    std::vector<SeenPixel> pixels;
    pixels.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            SeenPixel& pixel = pixels.emplace_back(sum_up(view, x, y, step_per_depth));
            if (pixel.front <= 0) continue;
            const Triangle& t = made.mesh.triangles[triangle_in(view, x, y)];
            const Vector3d a = to_eigen(made.true_positions[t[0]]), b = to_eigen(made.true_positions[t[1]]),
                           c = to_eigen(made.true_positions[t[2]]);
            const Vector3d ray = ray_of(camera, view.left + x + 0.5, view.top + y + 0.5);
            const Vector3d normal = (b - a).cross(c - a);
            pixel.facing = static_cast<float>(std::abs(normal.dot(ray)) / std::max(normal.norm() * ray.norm(), 1e-12));
            const Vector3d point =
                camera.position + static_cast<double>(pixel.centre > 0 ? pixel.centre : pixel.front) * ray;
            const SurfacePoint surface = evaluate_surface(scene, scene.present, point);
            pixel.colour = surface_colour(figure_of(surface.part), surface.rest);
        }
    return pixels;
}

// ---- Sheets ---------------------------------------------------------------------------------------------------------

// Triangles of pixels, whose numbers are those of the view.
std::vector<Triangle> join_pixels(const DepthCamera& camera, const DepthCameraOptions& options, const View& view,
                                  const std::vector<float>& depths) {
    const auto joined = [&](std::uint32_t a, std::uint32_t b) {
        return std::abs(depths[a] - depths[b]) <= step_limit(camera, options, std::min(depths[a], depths[b]));
    };
    std::vector<Triangle> triangles;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (depths[a] > 0 && depths[b] > 0 && depths[c] > 0 && joined(a, b) && joined(b, c) && joined(c, a))
            triangles.push_back({a, b, c});
    };
    for (int y = 0; y + 1 < view.height; ++y)
        for (int x = 0; x + 1 < view.width; ++x) {
            const auto a = static_cast<std::uint32_t>(y * view.width + x), b = a + 1,
                       c = a + static_cast<std::uint32_t>(view.width), d = c + 1;
            // Along the smaller step; where one corner is missing, the one that leaves it out.
            const bool falls = depths[a] > 0 && depths[d] > 0 &&
                               (depths[b] <= 0 || depths[c] <= 0 ||
                                std::abs(depths[a] - depths[d]) <= std::abs(depths[b] - depths[c]));
            if (falls) {
                add(a, c, d);
                add(a, d, b);
            } else {
                add(a, c, b);
                add(b, c, d);
            }
        }
    return triangles;
}

struct Sheet {
    Mesh mesh;
    std::vector<std::uint8_t> seen;
};

Sheet sheet_of(const DepthCamera& camera, const DepthCameraOptions& options, const SynthFrame& made,
               const PosedScene& scene, RandomKey key) {
    const DepthSensorModel& model = model_of(options.sensor);
    const View view = look(camera, made.true_positions, made.mesh.triangles);
    Sheet sheet;
    sheet.seen = seen_triangles(camera, model, view, made);
    const auto pixels = pixels_of(camera, view, made, scene);
    const auto depths = measured_depths(model, pixels, view.width, options.noise, key);
    std::vector<std::uint32_t> vertices(depths.size(), nothing);
    for (Triangle triangle : join_pixels(camera, options, view, depths)) {
        for (std::uint32_t& corner : triangle) {
            const std::uint32_t pixel = corner;
            if (vertices[pixel] == nothing) {
                vertices[pixel] = static_cast<std::uint32_t>(sheet.mesh.positions.size());
                const int x = static_cast<int>(pixel) % view.width, y = static_cast<int>(pixel) / view.width;
                const Vector3d ray = ray_of(camera, view.left + x + 0.5, view.top + y + 0.5);
                sheet.mesh.positions.push_back(to_float(camera.position + static_cast<double>(depths[pixel]) * ray));
                sheet.mesh.colours.push_back(pixels[pixel].colour);
            }
            corner = vertices[pixel];
        }
        sheet.mesh.triangles.push_back(triangle);
    }
    return sheet;
}

}  // namespace

Result<void> check_depth_cameras(const DepthCameraOptions& options) {
    if (options.cameras < 1 || options.cameras > most_cameras)
        return fail(ErrorKind::bad_input, "there can be 1 to " + std::to_string(most_cameras) + " depth cameras, not " +
                                              std::to_string(options.cameras));
    const bool is_phone = options.sensor == DepthSensor::phone;
    const int nearest = is_phone ? 300 : 1000, farthest = is_phone ? 1200 : 4000;
    if (options.distance != 0 && !(options.distance >= nearest && options.distance <= farthest))
        return fail(ErrorKind::bad_input, std::string("a ") + sensor_name(options.sensor) + " can be " +
                                              std::to_string(nearest) + " to " + std::to_string(farthest) + " mm away");
    if (options.vertices != 0 && (options.vertices < 500 || options.vertices > most_vertices))
        return fail(ErrorKind::bad_input, "depth cameras can deliver 500 to " + std::to_string(most_vertices) +
                                              " vertices a frame, not " + std::to_string(options.vertices));
    if (!(options.noise >= 0 && options.noise <= 4))
        return fail(ErrorKind::bad_input, "the noise of depth cameras must be between 0 and 4 times their own");
    return {};
}

double camera_distance(const SynthOptions& options, const DepthCameraOptions& cameras) {
    if (cameras.distance > 0) return cameras.distance;
    if (cameras.sensor == DepthSensor::phone) return 600;
    return options.motion == SynthMotion::tour || options.motion == SynthMotion::everyday ? 3000 : 2500;
}

int body_vertices(const DepthCameraOptions& options) {
    const bool is_phone = options.sensor == DepthSensor::phone;
    const int usual = is_phone ? 80000 : 40000;
    if (options.vertices <= 0) return usual;
    const double of_each = 1.0 * options.vertices / std::clamp(options.cameras, 1, most_cameras);
    const double finer = of_each / (is_phone ? 42000 : 12000);  // than with the sensor's own pixels
    constexpr double fewest = 20000, most = 1e6;
    return static_cast<int>(std::clamp(usual * finer, fewest, most));
}

std::vector<DepthCamera> depth_cameras(const SynthOptions& options, const DepthCameraOptions& cameras, int frame) {
    const DepthSensorModel& model = model_of(cameras.sensor);
    const auto [middle, front] = aim(options, cameras, frame);
    const double distance = camera_distance(options, cameras), finer = refinement(cameras, distance);
    const int count = std::clamp(cameras.cameras, 1, most_cameras);
    std::vector<DepthCamera> out;
    for (int i = 0; i < count; ++i) {
        DepthCamera& camera = out.emplace_back();
        camera.up = Eigen::Vector3d::UnitY();
        const double azimuth = 2 * std::numbers::pi * i / count;
        camera.backward = std::cos(azimuth) * front + std::sin(azimuth) * camera.up.cross(front);
        camera.right = camera.up.cross(camera.backward);
        camera.position = middle + distance * camera.backward;
        camera.width = static_cast<int>(std::lround(model.width * finer));
        camera.height = static_cast<int>(std::lround(model.height * finer));
        camera.focal = model.focal * finer;
    }
    return out;
}

double step_limit(const DepthCamera& camera, const DepthCameraOptions& options, double depth) {
    return 3.5 * depth / camera.focal + 3 * options.noise * noise_deviation(model_of(options.sensor), depth, 1, 1);
}

DepthCapture capture_depth(const SynthOptions& options, const DepthCameraOptions& cameras, const SynthFrame& made,
                           int frame, Threads threads) {
    DepthCapture out;
    out.cameras = depth_cameras(options, cameras, frame);
    const PosedScene scene = scene_at(options, frame);
    const RandomKey key =
        derive_key(derive_key(RandomKey{mix_bits(options.seed)}, camera_stream), static_cast<std::uint32_t>(frame));
    std::vector<Sheet> sheets(out.cameras.size());
    parallel_for(sheets.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            sheets[i] = sheet_of(out.cameras[i], cameras, made, scene, derive_key(key, i));
    });
    out.seen.resize(made.mesh.triangles.size());
    for (const Sheet& sheet : sheets) {
        const auto first = static_cast<std::uint32_t>(out.mesh.positions.size());
        out.sheets.push_back(static_cast<std::uint32_t>(sheet.mesh.positions.size()));
        out.mesh.positions.insert(out.mesh.positions.end(), sheet.mesh.positions.begin(), sheet.mesh.positions.end());
        out.mesh.colours.insert(out.mesh.colours.end(), sheet.mesh.colours.begin(), sheet.mesh.colours.end());
        for (const Triangle& t : sheet.mesh.triangles)
            out.mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        for (std::size_t t = 0; t < out.seen.size(); ++t) out.seen[t] |= sheet.seen[t];
    }
    if (!options.colours) out.mesh.colours.clear();
    if (options.normals)
        for (const auto& normal : vertex_normals(std::span<const Vector3f>(out.mesh.positions), out.mesh.triangles))
            out.mesh.normals.push_back(to_floats(normal));
    return out;
}

Mesh seen_surface(const SynthFrame& made, const DepthCapture& capture) {
    Mesh out;
    std::vector<std::uint32_t> vertices(made.true_positions.size(), nothing);
    for (std::size_t t = 0; t < capture.seen.size() && t < made.mesh.triangles.size(); ++t) {
        if (!capture.seen[t]) continue;
        Triangle triangle = made.mesh.triangles[t];
        for (std::uint32_t& corner : triangle) {
            if (vertices[corner] == nothing) {
                vertices[corner] = static_cast<std::uint32_t>(out.positions.size());
                out.positions.push_back(made.true_positions[corner]);
                if (!made.mesh.colours.empty()) out.colours.push_back(made.mesh.colours[corner]);
            }
            corner = vertices[corner];
        }
        out.triangles.push_back(triangle);
    }
    return out;
}

}  // namespace htvm
