// The surface of the synthetic scene as the zero set of a function: every part is a union of tapered rounded segments
// that move rigidly with it, parts blend smoothly where they meet, and a relief is added that moves with the body.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "synth/scene.h"

namespace htvm::synth {

// The function changes by at most about this much per mm.
inline constexpr double steepness = 1.3;

struct SurfacePoint {
    double distance = 0;   // mm, approximate signed distance to the dressed surface, negative inside
    Eigen::Vector3d rest;  // the position of this point of the body in the T-pose (rest_scene), mm
    std::size_t part = 0;  // the nearest one
};

// The function at a world point. Parts outside `candidates` are ignored.
SurfacePoint evaluate_surface(const PosedScene& scene, PartSet candidates, const Eigen::Vector3d& world);

// How it changes there along each axis, per mm.
Eigen::Vector3d surface_gradient(const PosedScene& scene, PartSet candidates, const Eigen::Vector3d& world);

struct BallBounds {
    PartSet candidates = 0;  // the parts that determine the function within the ball; the others have no effect there
    bool crosses = false;    // false: the surface does not enter the ball
};

// The parts that have an effect within a ball, given the candidates of a larger ball around it.
BallBounds bound_surface(const PosedScene& scene, PartSet candidates, const Eigen::Vector3d& centre, double radius);

// mm from the smooth shape of one part at its rest coordinates, negative inside.
double part_distance(std::size_t part, const Eigen::Vector3d& rest);

// The parts that one hangs together with, itself among them: where any other touches it, each keeps its own
// coordinates.
PartSet joined_parts(std::size_t part);

}  // namespace htvm::synth
