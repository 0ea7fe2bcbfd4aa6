#include "synth/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/posture.h"

namespace htvm::synth {
namespace {

using Eigen::Vector3d;
constexpr double degree = std::numbers::pi / 180.0;

// The schedule of one cycle, in seconds.
constexpr double ready_time = 0.45, fade = 0.4;
constexpr double walk_end = 2.2, wave_end = 4.2, turn_end = 6.2, cycle = 8.0;
constexpr double walk_speed = 1200.0, walk_radius = 1000.0;  // mm/s, mm

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
    const double heading = stance.walked / walk_radius;
    PosedBody body = place_body(stance.angles, about_y((heading + stance.turned) / degree));
    // The circle starts at the origin with the person facing +z, and turns to the person's left.
    const double height = stance.angles.lift - lowest_sole(body);
    shift_body(body, {walk_radius * (1 - std::cos(heading)), height, walk_radius * std::sin(heading)});
    return body;
}

}  // namespace htvm::synth
