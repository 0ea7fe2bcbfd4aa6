#include "synth/posture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace htvm::synth {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::size_t angle_count = sizeof(Angles) / sizeof(double);
constexpr double stride = 1300.0;  // mm

void place_limbs(PosedBody& body, const Angles& a) {
    auto& parts = body.parts;
    const auto& rest = rest_joints();
    const PartFrame pelvis = parts[index_of(Part::pelvis)], chest = parts[index_of(Part::chest)];
    for (std::size_t side = 0; side < 2; ++side) {
        const double s = side == 0 ? 1.0 : -1.0;
        const auto part = [&](Part left) -> PartFrame& { return parts[index_of(left) + side]; };
        const Matrix3d shoulder =
            about_x(-a.arm_swing[side]) * about_z(-s * a.arm_lower[side]) * about_x(a.arm_twist[side]);
        part(Part::left_upper_arm) = attach(chest, rest[3 + 3 * side], shoulder);
        part(Part::left_forearm) = attach(part(Part::left_upper_arm), rest[4 + 3 * side], about_y(-s * a.elbow[side]));
        part(Part::left_hand) =
            attach(part(Part::left_forearm), Vector3d(s * 712, 1395, 0), about_y(-s * a.wrist[side]));
        part(Part::left_thigh) =
            attach(pelvis, rest[9 + 3 * side], about_x(-a.hip_flex[side]) * about_z(s * a.hip_spread[side]));
        part(Part::left_shin) = attach(part(Part::left_thigh), rest[10 + 3 * side], about_x(a.knee[side]));
        part(Part::left_foot) = attach(part(Part::left_shin), rest[11 + 3 * side], about_x(-a.ankle[side]));
    }
}

}  // namespace

void add_weighted(Angles& sum, double weight, const Angles& angles) {
    auto* to = reinterpret_cast<double*>(&sum);
    const auto* from = reinterpret_cast<const double*>(&angles);
    for (std::size_t i = 0; i < angle_count; ++i) to[i] += weight * from[i];
}

double smooth_step(double u) {
    u = std::clamp(u, 0.0, 1.0);
    return u * u * (3.0 - 2.0 * u);
}

double smooth_step_integral(double u) {
    if (u <= 0) return 0.0;
    return u < 1 ? u * u * u * (1.0 - 0.5 * u) : u - 0.5;
}

double bump(double t, double begin, double end) {
    const double u = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
    return 0.5 - 0.5 * std::cos(full_turn * u);
}

Angles stand(double t) {
    Angles a;
    const double breath = std::sin(full_turn * 0.27 * t), sway = std::sin(full_turn * 0.19 * t + 0.7);
    a.spine_pitch = 2 + 0.8 * breath;
    a.pelvis_roll = 1.2 * sway;
    a.spine_roll = -1.5 * sway;
    a.head_yaw = 6 * sway;
    for (int side = 0; side < 2; ++side) {
        a.arm_lower[side] = 74 - 1.5 * breath;
        a.arm_swing[side] = 4;
        a.elbow[side] = 16;
        a.wrist[side] = 4;
        a.hip_spread[side] = 3;
        a.hip_flex[side] = 3;
        a.knee[side] = 5;
        a.ankle[side] = 2;
    }
    return a;
}

Angles walk(double t, double distance) {
    Angles a = stand(t);
    const double phase = full_turn * distance / stride;
    a.pelvis_yaw = 6 * std::cos(phase);
    a.spine_yaw = -11 * std::cos(phase);
    a.pelvis_roll = 3 * std::sin(phase);
    a.spine_roll = -4 * std::sin(phase);
    a.spine_pitch = 4 + 1.5 * std::cos(2 * phase);
    a.head_yaw = 3 * std::cos(phase);
    for (int side = 0; side < 2; ++side) {
        const double p = phase + (side == 0 ? 0.0 : std::numbers::pi);
        const double swing_knee = 0.5 + 0.5 * std::cos(p - 4.7);
        a.hip_flex[side] = 7 + 24 * std::cos(p);
        a.knee[side] = 9 + 52 * swing_knee * swing_knee + 4 * std::cos(2 * p);
        a.ankle[side] = 0.6 * (a.knee[side] - a.hip_flex[side]) - 3;  // keeps the foot nearly level
        a.arm_swing[side] = 3 - 24 * std::cos(p);
        a.elbow[side] = 26 - 14 * std::cos(p);
    }
    return a;
}

Matrix3d about_x(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitX()).toRotationMatrix(); }
Matrix3d about_y(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitY()).toRotationMatrix(); }
Matrix3d about_z(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitZ()).toRotationMatrix(); }

Vector3d carry(const PartFrame& frame, const Vector3d& rest) {
    return frame.rotation * (rest - frame.rest_pivot) + frame.pivot;
}

PartFrame attach(const PartFrame& parent, const Vector3d& rest_pivot, const Matrix3d& local_rotation) {
    return {parent.rotation * local_rotation, rest_pivot, carry(parent, rest_pivot)};
}

PosedBody place_body(const Angles& a, const Matrix3d& facing) {
    const auto& rest = rest_joints();
    PosedBody body;
    auto& parts = body.parts;
    const Matrix3d pelvis_turn = about_y(a.pelvis_yaw) * about_z(a.pelvis_roll) * about_x(a.pelvis_pitch);
    parts[index_of(Part::pelvis)] = {facing * pelvis_turn, rest[2], rest[2]};
    const PartFrame pelvis = parts[index_of(Part::pelvis)];
    const Matrix3d spine = about_y(a.spine_yaw) * about_z(a.spine_roll) * about_x(a.spine_pitch);
    parts[index_of(Part::chest)] = attach(pelvis, Vector3d(0, 1075, -10), spine);
    const Matrix3d head = about_y(a.head_yaw) * about_z(a.head_roll) * about_x(a.head_pitch);
    const Matrix3d half_head = about_y(a.head_yaw / 2) * about_z(a.head_roll / 2) * about_x(a.head_pitch / 2);
    parts[index_of(Part::neck)] = attach(parts[index_of(Part::chest)], rest[1], half_head);
    parts[index_of(Part::head)] =
        attach(parts[index_of(Part::neck)], Vector3d(0, 1545, 0), half_head.transpose() * head);
    place_limbs(body, a);
    place_joints(body);
    return body;
}

void place_joints(PosedBody& body) {
    const auto& rest = rest_joints();
    constexpr std::array<Part, joint_count> carrier = {
        Part::head,          Part::neck,         Part::pelvis,          Part::left_upper_arm,
        Part::left_forearm,  Part::left_forearm, Part::right_upper_arm, Part::right_forearm,
        Part::right_forearm, Part::left_thigh,   Part::left_shin,       Part::left_foot,
        Part::right_thigh,   Part::right_shin,   Part::right_foot};
    for (std::size_t j = 0; j < joint_count; ++j) body.joints[j] = carry(body.parts[index_of(carrier[j])], rest[j]);
}

void shift_body(PosedBody& body, const Vector3d& shift) {
    for (auto& frame : body.parts) frame.pivot += shift;
    for (auto& joint : body.joints) joint += shift;
}

double lowest_sole(const PosedBody& body) {
    constexpr double softness = 6.0;
    std::array<double, 4> heights;
    for (std::size_t side = 0; side < 2; ++side) {
        const PartFrame& foot = body.parts[index_of(Part::left_foot) + side];
        const double x = side == 0 ? 102.0 : -102.0;
        heights[2 * side] = carry(foot, {x, 0, -72}).y();
        heights[2 * side + 1] = carry(foot, {x, 0, 140}).y();
    }
    const double lowest = *std::ranges::min_element(heights);
    double sum = 0;
    for (const double height : heights) sum += std::exp((lowest - height) / softness);
    return lowest - softness * std::log(sum / static_cast<double>(heights.size()));
}

}  // namespace htvm::synth
