#include "synth/depth_sensor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace htvm::synth {
namespace {

// A Kinect v2. Image and focal length are the depth camera's own. Noise: P. Fankhauser et al., "Kinect v2 for mobile
// robot navigation: evaluation and modeling", ICAR 2015, whose law of distance and angle this is. It tells whole
// millimetres between 0.5 and 4.5 m.
constexpr DepthSensorModel kinect = {.width = 512,
                                     .height = 424,
                                     .focal = 366,
                                     .nearest = 500,
                                     .farthest = 4500,
                                     .noise_constant = 1.5,
                                     .noise_linear = -0.5,
                                     .noise_square = 0.3,
                                     .noise_slope = 0.1,
                                     .noise_dark = 1,
                                     .noise_fine = 0.5,
                                     .grain = 3,
                                     .depth_step = 1,
                                     .disparity_step = 0,
                                     .lost = 0.004,
                                     .lost_in_the_dark = 0.04,
                                     .least_facing = 0.12,
                                     .mixed_lost = 0.35,
                                     .mixed_flying = 0.45,
                                     .longest_flight = 100};

// The camera on a phone's face, at half of its 480 x 640 pixels, as programs that record with it save. Errors are in
// the range of millimetres (A. Breitbarth et al., "Measurement accuracy and dependence on external influences of the
// iPhone X TrueDepth sensor", SPIE 11144, 2019): 0.5 % at 60 cm, growing with the square as of all triangulation, but
// smoothed by the phone, so that it comes in waves. Disparities are in half precision, whose step is 1/1024 around
// one per metre.
constexpr DepthSensorModel phone = {.width = 240,
                                    .height = 320,
                                    .focal = 400,
                                    .nearest = 200,
                                    .farthest = 1500,
                                    .noise_constant = 0.2,
                                    .noise_linear = 0,
                                    .noise_square = 7.8,
                                    .noise_slope = 0.3,
                                    .noise_dark = 0.5,
                                    .noise_fine = 0.02,
                                    .grain = 10,
                                    .depth_step = 0,
                                    .disparity_step = 1.0 / 1024,
                                    .lost = 0.0005,
                                    .lost_in_the_dark = 0.02,
                                    .least_facing = 0.1,
                                    .mixed_lost = 0.2,
                                    .mixed_flying = 0.4,
                                    .longest_flight = 60};

// The streams of random numbers of an image.
enum Stream : std::uint64_t { fine_stream, grain_stream, lost_stream, patch_stream, shift_stream, mixed_stream };

std::uint64_t cell_index(int x, int y) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32 | static_cast<std::uint32_t>(x);
}

// Numbers of variance 1 on the corners of a grid of `grain` pixels, in between by bilinear weights.
double grained(RandomKey key, int grain, int x, int y) {
    const int left = x / grain, top = y / grain;
    const double u = static_cast<double>(x % grain) / grain, v = static_cast<double>(y % grain) / grain;
    double sum = 0, squares = 0;
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const double weight = (i ? u : 1 - u) * (j ? v : 1 - v);
            sum += weight * random_gaussian(key, cell_index(left + i, top + j));
            squares += weight * weight;
        }
    return sum / std::sqrt(squares);
}

double brightness(const Colour& colour) { return (0.3 * colour[0] + 0.6 * colour[1] + 0.1 * colour[2]) / 255; }

// Black, and dark grey partly: infrared light does not come back from it.
double darkness(double bright) { return std::clamp(1 - 4 * bright, 0.0, 1.0); }

// Uniform in [0, 1), the same in ragged patches of pixels.
double patchy(RandomKey key, int x, int y) {
    constexpr int patch = 6, shift = 3;  // pixels
    const std::uint64_t bits = random_bits(derive_key(key, shift_stream), cell_index(x, y));
    const int shifted_x = x + static_cast<int>(bits % shift), shifted_y = y + static_cast<int>(bits / shift % shift);
    return random_uniform(derive_key(key, patch_stream), cell_index(shifted_x / patch, shifted_y / patch));
}

// Single pixels and, as often, patches of them.
bool is_lost(RandomKey key, int x, int y, double share) {
    if (share >= 1) return true;
    const double half = 1 - std::sqrt(1 - share);
    return random_uniform(key, cell_index(x, y)) < half || patchy(key, x, y) < half;
}

double stepped(const DepthSensorModel& model, double depth) {
    if (model.depth_step > 0) return model.depth_step * std::round(depth / model.depth_step);
    const double step = model.disparity_step / 1000;  // 1/mm
    return 1 / (step * std::max(1.0, std::round(1 / (step * depth))));
}

// Where a pixel's light comes from: its depth, 0 for none, and how the surface there is turned.
struct Lit {
    double depth, facing;
};

// On edges light may come from both sides, and what the sensor makes of it lies between them: further back the more of
// the pixel, and the brighter, what is behind. Along an edge pixels are lost or fly together.
Lit lit_place(const DepthSensorModel& model, const SeenPixel& pixel, double noise, RandomKey key, int x, int y) {
    const Lit centre{pixel.centre, pixel.facing};
    if (pixel.cover >= 1) return centre;
    const double chance = patchy(key, x, y);
    if (chance < noise * model.mixed_lost) return {0, 1};
    if (chance >= noise * (model.mixed_lost + model.mixed_flying)) return centre;
    const double gap = pixel.back > 0 ? pixel.back - pixel.front : model.longest_flight;
    const double behind = 0.5 * patchy(derive_key(key, 0), x, y) + 0.5 * random_uniform(key, cell_index(x, y));
    return {pixel.front + behind * (1 - pixel.cover) * std::min(gap, model.longest_flight), 1};
}

}  // namespace

const DepthSensorModel& model_of(DepthSensor sensor) { return sensor == DepthSensor::phone ? phone : kinect; }

double noise_deviation(const DepthSensorModel& model, double depth, double facing, double bright) {
    const double z = depth / 1000;
    const double angle = std::acos(std::clamp(facing, 0.05, 1.0));
    const double turned = angle / (std::numbers::pi / 2 - angle);
    const double deviation = model.noise_constant + z * (model.noise_linear + z * model.noise_square) +
                             model.noise_slope * z * std::sqrt(z) * turned * turned;
    return deviation * (1 + model.noise_dark * darkness(bright));
}

double facing_loss(const DepthSensorModel& model, double facing) {
    return std::clamp((3 * model.least_facing - facing) / (2 * model.least_facing), 0.0, 1.0);
}

std::vector<float> measured_depths(const DepthSensorModel& model, const std::vector<SeenPixel>& pixels, int width,
                                   double noise, RandomKey key) {
    std::vector<float> depths(pixels.size(), 0.0F);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const SeenPixel& pixel = pixels[i];
        if (pixel.front <= 0) continue;
        const int x = static_cast<int>(i % static_cast<std::size_t>(width)),
                  y = static_cast<int>(i / static_cast<std::size_t>(width));
        const Lit lit = lit_place(model, pixel, noise, derive_key(key, mixed_stream), x, y);
        double depth = lit.depth;
        if (depth < model.nearest || depth > model.farthest) continue;
        if (noise > 0) {
            const double bright = brightness(pixel.colour);
            const double share =
                model.lost + model.lost_in_the_dark * darkness(bright) + facing_loss(model, lit.facing);
            if (is_lost(derive_key(key, lost_stream), x, y, noise * share)) continue;
            const double fine = random_gaussian(derive_key(key, fine_stream), i),
                         coarse = grained(derive_key(key, grain_stream), model.grain, x, y);
            const double error =
                std::clamp(std::sqrt(model.noise_fine) * fine + std::sqrt(1 - model.noise_fine) * coarse, -4.0, 4.0);
            depth = stepped(model, depth + noise * error * noise_deviation(model, depth, lit.facing, bright));
            if (depth < model.nearest || depth > model.farthest) continue;
        }
        depths[i] = static_cast<float>(depth);
    }
    return depths;
}

}  // namespace htvm::synth
