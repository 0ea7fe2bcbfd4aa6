// What a depth sensor makes of what lies before its pixels: noise that grows with distance, slope and darkness, steps
// of depth, pixels without a depth, and pixels on edges that lie in mid-air.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "synth/random.h"

namespace htvm {

enum class DepthSensor : std::uint8_t {
    kinect,  // measures the time of flight of light: a whole person from metres away
    phone,   // projects a pattern of dots, as on the face of a phone: head and shoulders from an arm's length
};

// How a sensor is called on command lines.
inline constexpr std::array depth_sensors = {DepthSensor::kinect, DepthSensor::phone};
constexpr const char* sensor_name(DepthSensor sensor) { return sensor == DepthSensor::phone ? "phone" : "kinect"; }

}  // namespace htvm

namespace htvm::synth {

// Depths are along the camera's axis, not along the pixel's ray. Shares of pixels are for a noise of 1.
struct DepthSensorModel {
    int width, height;         // pixels
    double focal;              // pixels: how much wider a thing is in the image than wide by its depth
    double nearest, farthest;  // mm; what is not between them is not measured
    double noise_constant;     // the deviation of the noise is, mm, at z metres: constant + linear z + square z^2,
    double noise_linear;       //
    double noise_square;       //
    double noise_slope;        // plus slope z^1.5 (a / (pi/2 - a))^2 on a surface that is turned away by an angle a
    double noise_dark;         // more by this share of itself where the surface is black
    double noise_fine;         // share of its power that is new in each pixel; the rest comes in waves,
    int grain;                 // which are so many pixels wide
    double depth_step;         // mm between the depths that the sensor can tell; 0: see disparity_step
    double disparity_step;     // 1/m between the inverse depths that it can tell
    double lost;               // share of pixels without a depth anywhere,
    double lost_in_the_dark;   // more of them where the surface is black,
    double least_facing;       // and all where the cosine between normal and ray is below this; see facing_loss()
    double mixed_lost;         // share of the pixels on edges that have no depth
    double mixed_flying;       // share of them that lie between what is before and what is behind the edge
    double longest_flight;     // mm that they lie behind the edge at most
};

const DepthSensorModel& model_of(DepthSensor sensor);

// What lies before a pixel.
struct SeenPixel {
    float centre = 0;  // mm: depth at the pixel's centre; 0: nothing
    float front = 0;   // mm: the nearest depth within the pixel; 0: nothing
    float back = 0;    // mm: what else is in a pixel on an edge, behind the front; 0: nothing
    float cover = 0;   // share of the pixel that the front covers; 1: it is not on an edge
    float facing = 1;  // cosine between the surface's normal and the ray
    Colour colour{};   // of the surface
};

// The deviation of the noise, mm, of a surface at a depth (mm) and a facing; bright: 0 for black to 1.
double noise_deviation(const DepthSensorModel& model, double depth, double facing, double bright);

// Share of pixels without a depth where a surface is seen from the side: 0 above three times least_facing, 1 below it.
double facing_loss(const DepthSensorModel& model, double facing);

// A depth for each pixel, row by row; 0: none. `noise` is a share of the sensor's own, of the lost and flying pixels,
// too; 0: the depths are exact, and every centre that is within reach has one. No error is larger than four deviations,
// a step and, on edges, longest_flight. Each pixel depends on itself and the key alone.
std::vector<float> measured_depths(const DepthSensorModel& model, const std::vector<SeenPixel>& pixels, int width,
                                   double noise, RandomKey key);

}  // namespace htvm::synth
