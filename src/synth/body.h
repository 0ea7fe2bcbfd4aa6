// The synthetic person's surface as the zero set of a function: every part is a union of tapered rounded segments that
// move rigidly with it, parts blend smoothly where they meet, and a relief is added that moves with the body.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "synth/motion.h"

namespace htvm::synth {

// A set of parts, bit i for part i.
using PartSet = std::uint32_t;
inline constexpr PartSet all_parts = (PartSet{1} << part_count) - 1;

// The function changes by at most about this much per mm.
inline constexpr double steepness = 1.3;

struct SurfacePoint {
    double distance = 0;   // mm, approximate signed distance to the dressed surface, negative inside
    Eigen::Vector3d rest;  // the position of this point of the body in the T-pose, mm
};

// The function at a world point. Parts outside `candidates` are ignored.
SurfacePoint evaluate_body(const PosedBody& body, PartSet candidates, const Eigen::Vector3d& world);

struct BallBounds {
    PartSet candidates = 0;  // the parts that determine the function within the ball; the others have no effect there
    bool crosses = false;    // false: the surface does not enter the ball
};

// The parts that have an effect within a ball, given the candidates of a larger ball around it.
BallBounds bound_body(const PosedBody& body, PartSet candidates, const Eigen::Vector3d& centre, double radius);

}  // namespace htvm::synth
