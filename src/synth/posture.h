// Postures of the synthetic person: the angles of the joints, how they place the parts of the body, and those that
// several motions share.
#pragma once

#include <Eigen/Core>
#include <numbers>

#include "synth/motion.h"

namespace htvm::synth {

inline constexpr double full_turn = 2.0 * std::numbers::pi;

// Angles in degrees; of each pair, the first is for the left side. All zero is the T-pose.
struct Angles {
    double pelvis_yaw = 0, pelvis_roll = 0, pelvis_pitch = 0;
    double spine_pitch = 0, spine_yaw = 0, spine_roll = 0;
    double head_pitch = 0, head_yaw = 0, head_roll = 0;
    double arm_lower[2] = {}, arm_swing[2] = {}, arm_twist[2] = {}, elbow[2] = {}, wrist[2] = {};
    double hip_flex[2] = {}, hip_spread[2] = {}, knee[2] = {}, ankle[2] = {};
    double lift = 0;  // mm, height of the whole body above its stance
};

// sum += weight * angles, field by field.
void add_weighted(Angles& sum, double weight, const Angles& angles);

// From 0 to 1 over u = 0 to 1, without a jump of the slope; and its integral from minus infinity.
double smooth_step(double u);
double smooth_step_integral(double u);

// Rises smoothly from 0 to 1 and falls again within [begin, end].
double bump(double t, double begin, double end);

// Standing at ease at a time (s), breathing and swaying.
Angles stand(double t);

// Walking, so far along the way (mm).
Angles walk(double t, double distance);

// Rotations about the axes of rest coordinates, by degrees.
Eigen::Matrix3d about_x(double degrees);
Eigen::Matrix3d about_y(double degrees);
Eigen::Matrix3d about_z(double degrees);

constexpr std::size_t index_of(Part part) { return static_cast<std::size_t>(part); }

// Where a rest point of a part lies in the world.
Eigen::Vector3d carry(const PartFrame& frame, const Eigen::Vector3d& rest);

// A part attached to its parent, turning about a rest point of the parent.
PartFrame attach(const PartFrame& parent, const Eigen::Vector3d& rest_pivot, const Eigen::Matrix3d& local_rotation);

// The body with its pelvis where it is in the T-pose, turned by `facing`; only angles.lift has no effect.
PosedBody place_body(const Angles& angles, const Eigen::Matrix3d& facing);

// The joints, from the parts.
void place_joints(PosedBody& body);

void shift_body(PosedBody& body, const Eigen::Vector3d& shift);

// The height of the lowest point of the shoes: a soft minimum, so that a change of foot causes no jolt.
double lowest_sole(const PosedBody& body);

}  // namespace htvm::synth
