#include "synth/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace htvm::synth {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double degree = std::numbers::pi / 180.0;
constexpr double full_turn = 2.0 * std::numbers::pi;

// Angles in degrees; of each pair, the first is for the left side. All zero is the T-pose.
struct Angles {
    double pelvis_yaw = 0, pelvis_roll = 0, pelvis_pitch = 0;
    double spine_pitch = 0, spine_yaw = 0, spine_roll = 0;
    double head_pitch = 0, head_yaw = 0, head_roll = 0;
    double arm_lower[2] = {}, arm_swing[2] = {}, arm_twist[2] = {}, elbow[2] = {}, wrist[2] = {};
    double hip_flex[2] = {}, hip_spread[2] = {}, knee[2] = {}, ankle[2] = {};
    double lift = 0;  // mm, height of the whole body above its stance
};
constexpr std::size_t angle_count = sizeof(Angles) / sizeof(double);

// sum += weight * angles, field by field.
void add_weighted(Angles& sum, double weight, const Angles& angles) {
    auto* to = reinterpret_cast<double*>(&sum);
    const auto* from = reinterpret_cast<const double*>(&angles);
    for (std::size_t i = 0; i < angle_count; ++i) to[i] += weight * from[i];
}

double smooth_step(double u) {
    u = std::clamp(u, 0.0, 1.0);
    return u * u * (3.0 - 2.0 * u);
}

// The integral of smooth_step from minus infinity to u.
double smooth_step_integral(double u) {
    if (u <= 0) return 0.0;
    return u < 1 ? u * u * u * (1.0 - 0.5 * u) : u - 0.5;
}

// Rises smoothly from 0 to 1 and falls again within [begin, end].
double bump(double t, double begin, double end) {
    const double u = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
    return 0.5 - 0.5 * std::cos(full_turn * u);
}

// The schedule of one cycle, in seconds.
constexpr double ready_time = 0.45, fade = 0.4;
constexpr double walk_end = 2.2, wave_end = 4.2, turn_end = 6.2, cycle = 8.0;
constexpr double walk_speed = 1200.0, stride = 1300.0, walk_radius = 1000.0;  // mm/s, mm, mm

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

Angles wave(double t, double local) {
    Angles a = stand(t);
    const double beat = std::sin(full_turn * 1.5 * local);
    a.arm_lower[1] = -18 + 4 * beat;
    a.arm_swing[1] = 12;
    a.arm_twist[1] = -88;
    a.elbow[1] = 72 + 27 * beat;
    a.wrist[1] = -8 * std::sin(full_turn * 1.5 * local - 0.9);
    a.arm_lower[0] = 62;
    a.elbow[0] = 62 + 4 * beat;  // keeps the other hand near the hip
    a.arm_twist[0] = 22;
    a.spine_roll = 4 + 1.5 * beat;
    a.head_roll = 5;
    a.head_yaw = -14;
    return a;
}

Angles turn(double t, double local) {
    Angles a = stand(t);
    for (int side = 0; side < 2; ++side) {
        const double step = std::max(0.0, std::sin(full_turn * 1.25 * local + (side == 0 ? 0.0 : std::numbers::pi)));
        const double raise = step * step * (3 - 2 * step);
        a.hip_flex[side] = 3 + 30 * raise;
        a.knee[side] = 5 + 48 * raise;
        a.ankle[side] = 2 + 6 * raise;
        a.arm_lower[side] = 52;
        a.arm_swing[side] = side == 0 ? 22 : -14;
        a.elbow[side] = 34;
    }
    a.spine_yaw = 14 * bump(local, 0.0, 1.6);
    a.head_yaw = 24 * bump(local, 0.0, 1.4);
    return a;
}

// Crouch, push off, 0.46 s of flight with a height of 260 mm, landing, recovery.
Angles jump(double t, double local) {
    Angles a = stand(t);
    constexpr double take_off = 0.72, landing = take_off + 0.46;
    const double crouch = bump(local, 0.15, take_off + 0.02) + 0.75 * bump(local, landing - 0.06, landing + 0.5);
    const double air = bump(local, take_off - 0.14, landing + 0.14);
    a.spine_pitch += 26 * crouch - 4 * air;
    a.head_pitch = -14 * crouch;
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += 58 * crouch + 16 * air;
        a.knee[side] += 84 * crouch + 26 * air;
        a.ankle[side] += 26 * crouch - 24 * air;
        a.hip_spread[side] += 7 * air;
        a.arm_swing[side] += -38 * crouch + 74 * air;
        a.arm_lower[side] -= 28 * air;
        a.elbow[side] += 22 * crouch + 26 * air;
    }
    const double flight = (local - take_off) / (landing - take_off);
    if (flight > 0 && flight < 1) a.lift = 4 * 260.0 * flight * (1 - flight);
    return a;
}

// How far the person has walked since ready_time: the integral of the speed, which fades in and out.
double walked_distance(double time) {
    const double cycles = std::floor(time / cycle), local = time - cycles * cycle;
    const auto ramp = [](double t) { return fade * smooth_step_integral((t + fade / 2) / fade); };
    // Over a cycle the walk lasts walk_end: the start of the cycle cuts its fade-in in half, and the end completes it.
    const double within = ramp(local) - ramp(0) - ramp(local - walk_end) + ramp(local - cycle);
    return walk_speed * (cycles * walk_end + within);
}

struct Stance {
    Angles angles;
    double walked = 0, turned = 0;  // mm along the circle, radians on the spot
};

Stance stance_at(double seconds) {
    const double time = std::max(0.0, seconds - ready_time);
    const double cycles = std::floor(time / cycle), local = time - cycles * cycle;
    const auto step = [&](double at) { return smooth_step((local - at + fade / 2) / fade); };
    const double walking = step(0) - step(walk_end) + step(cycle);
    const double waving = step(walk_end) - step(wave_end), turning = step(wave_end) - step(turn_end);
    const double jumping = 1.0 - walking - waving - turning;
    Stance stance;
    stance.walked = walked_distance(time);
    // At the start of a cycle, the jump that fades out began at the end of the previous cycle.
    const double jump_time = local < fade ? local + cycle - turn_end : local - turn_end;
    Angles moving;
    add_weighted(moving, walking, walk(seconds, stance.walked));
    add_weighted(moving, waving, wave(seconds, local - walk_end));
    add_weighted(moving, turning, turn(seconds, local - wave_end));
    add_weighted(moving, jumping, jump(seconds, jump_time));
    const double out = smooth_step((seconds - 0.07) / 0.55);  // the rest of the weight is on the T-pose, which is all
                                                              // zeros
    add_weighted(stance.angles, out, moving);
    const double u = smooth_step((local - wave_end - 0.1) / (turn_end - wave_end - 0.2));
    stance.turned = full_turn * u;
    return stance;
}

Matrix3d about_x(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitX()).toRotationMatrix(); }
Matrix3d about_y(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitY()).toRotationMatrix(); }
Matrix3d about_z(double degrees) { return Eigen::AngleAxisd(degrees * degree, Vector3d::UnitZ()).toRotationMatrix(); }

std::size_t index_of(Part part) { return static_cast<std::size_t>(part); }

Vector3d carry(const PartFrame& frame, const Vector3d& rest) {
    return frame.rotation * (rest - frame.rest_pivot) + frame.pivot;
}

// Attaches a part to its parent, turning about a rest point of the parent.
PartFrame attach(const PartFrame& parent, const Vector3d& rest_pivot, const Matrix3d& local_rotation) {
    return {parent.rotation * local_rotation, rest_pivot, carry(parent, rest_pivot)};
}

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

void place_joints(PosedBody& body) {
    const auto& rest = rest_joints();
    constexpr std::array<Part, joint_count> carrier = {
        Part::head,          Part::neck,         Part::pelvis,          Part::left_upper_arm,
        Part::left_forearm,  Part::left_forearm, Part::right_upper_arm, Part::right_forearm,
        Part::right_forearm, Part::left_thigh,   Part::left_shin,       Part::left_foot,
        Part::right_thigh,   Part::right_shin,   Part::right_foot};
    for (std::size_t j = 0; j < joint_count; ++j) body.joints[j] = carry(body.parts[index_of(carrier[j])], rest[j]);
}

// The height of the lowest point of the shoes: a soft minimum, so that a change of foot causes no jolt.
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

}  // namespace

const std::array<Vector3d, joint_count>& rest_joints() {
    static const std::array<Vector3d, joint_count> joints = {
        Vector3d(0, 1640, 10),   Vector3d(0, 1465, -8),  Vector3d(0, 1000, 0),     Vector3d(178, 1395, -4),
        Vector3d(462, 1395, -2), Vector3d(728, 1395, 0), Vector3d(-178, 1395, -4), Vector3d(-462, 1395, -2),
        Vector3d(-728, 1395, 0), Vector3d(92, 915, 0),   Vector3d(98, 500, 4),     Vector3d(100, 85, -14),
        Vector3d(-92, 915, 0),   Vector3d(-98, 500, 4),  Vector3d(-100, 85, -14)};
    return joints;
}

PosedBody pose_body(double seconds) {
    const Stance stance = stance_at(std::max(0.0, seconds));
    const Angles& a = stance.angles;
    const auto& rest = rest_joints();
    PosedBody body;
    auto& parts = body.parts;
    const double heading = stance.walked / walk_radius;
    const Matrix3d facing = about_y((heading + stance.turned) / degree);
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

    const double lowest = lowest_sole(body);
    // The circle starts at the origin with the person facing +z, and turns to the person's left.
    const Vector3d shift(walk_radius * (1 - std::cos(heading)), a.lift - lowest, walk_radius * std::sin(heading));
    for (auto& frame : parts) frame.pivot += shift;
    for (auto& joint : body.joints) joint += shift;
    return body;
}

}  // namespace htvm::synth
