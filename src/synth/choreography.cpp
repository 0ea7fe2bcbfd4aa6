#include "synth/choreography.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "synth/arms.h"
#include "synth/posture.h"
#include "synth/random.h"

namespace htvm::synth {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// ---- What a move is -------------------------------------------------------------------------------------------------

struct Posture {
    Angles angles;
    std::array<Hold, 2> holds;             // of the left and the right hand
    std::array<double, 2> in_pocket = {};  // how far each hand is in its pocket
    double left_weight = 0.5;              // share of the body's weight on the left foot, which stays where it is
    double turned = 0;                     // degrees to the left since the move began
    Vector3d moved = Vector3d::Zero();     // mm since the move began, x to the left and z ahead as it began
    Vector3d ball = Vector3d::Zero();      // mm, how far the ball is from its place on the floor, likewise
};

// A moment of a move.
struct Moment {
    double seconds, local, duration;  // s: since the start of the capture, since the start of the move; how long it is
    RandomKey key;

    double drawn(std::uint64_t index, double low, double high) const {
        return low + (high - low) * random_uniform(key, index);
    }
    std::size_t side() const { return random_bits(key, 99) & 1; }  // which hand or foot comes first
    double at_end() const { return duration - local; }
    // Rises within `rise` seconds from `begin` on, and falls within the same time to be back at `end`.
    double between(double begin, double end, double rise) const {
        return smooth_step((local - begin) / rise) * smooth_step((end - local) / rise);
    }
};

struct MoveKind {
    double shortest, longest;  // s
    Posture (*at)(const Moment&);
};

// ---- What moves are made of -----------------------------------------------------------------------------------------

double sign_of(std::size_t side) { return side == 0 ? 1.0 : -1.0; }

Posture standing(const Moment& m) {
    Posture p;
    p.angles = stand(m.seconds);
    return p;
}

// Lays a hand on a part; place and direction are given for the left hand.
void lay_hand(Posture& p, std::size_t side, std::size_t part, Vector3d place, Vector3d inwards, double weight) {
    place.x() *= sign_of(side);
    inwards.x() *= sign_of(side);
    p.holds[side].part = part;
    p.holds[side].place = place;
    p.holds[side].inwards = inwards.normalized();
    p.holds[side].weight = weight;
}

// Ankles such that the feet are level.
void level_feet(Angles& a) {
    for (int side = 0; side < 2; ++side) a.ankle[side] = a.pelvis_pitch - a.hip_flex[side] + a.knee[side];
}

// Steps on the spot, as far as `amount`.
void step_on_the_spot(Angles& a, double time, double amount) {
    for (int side = 0; side < 2; ++side) {
        const double lifted = std::max(0.0, std::sin(full_turn * 1.3 * time + (side == 0 ? 0.0 : std::numbers::pi)));
        const double raised = amount * smooth_step(lifted);
        a.hip_flex[side] += 26 * raised;
        a.knee[side] += 44 * raised;
        a.ankle[side] += 14 * raised;
    }
}

void look(Posture& p, const Moment& m, double yaw, double pitch) {
    const double share = m.between(0.1, m.duration, 0.7);
    p.angles.head_yaw += share * yaw;
    p.angles.spine_yaw += 0.25 * share * yaw;
    p.angles.head_pitch += share * pitch;
}

// Hands in the pockets; place and size as in build_pockets().
void put_in_pocket(Posture& p, std::size_t side, double weight) {
    lay_hand(p, side, left_pocket + side, {159, 822, 33}, {-1, 0, -0.15}, weight);
    p.holds[side].clearance = -27;
    p.holds[side].fingers = {0, -1, 0.15};
    p.angles.arm_swing[side] += weight * (-14 - p.angles.arm_swing[side]);
    p.angles.arm_lower[side] += weight * (60 - p.angles.arm_lower[side]);
    p.angles.elbow[side] += weight * (48 - p.angles.elbow[side]);
    p.angles.arm_twist[side] += weight * 20;
    p.in_pocket[side] = smooth_step((weight - 0.55) / 0.4);
}

// ---- Calm -----------------------------------------------------------------------------------------------------------

Posture look_about(const Moment& m) {
    Posture p = standing(m);
    look(p, m, m.drawn(0, -30, 30), m.drawn(1, -8, 12));
    const double shifted = m.between(0.2, m.duration, 1.0) * sign_of(m.side());
    p.angles.pelvis_roll += 3 * shifted;
    p.angles.spine_roll -= 4 * shifted;
    return p;
}

Posture talk(const Moment& m) {
    Posture p = standing(m);
    look(p, m, m.drawn(0, -15, 15), 3);
    const bool both = random_uniform(m.key, 1) < 0.5;
    const double beat = full_turn * m.drawn(2, 0.55, 0.95) * m.local;
    for (std::size_t side = 0; side < 2; ++side) {
        if (!both && side != m.side()) continue;
        const double share = m.between(0.1, m.duration, 0.6), phase = beat + 0.9 * static_cast<double>(side);
        Angles& a = p.angles;
        a.elbow[side] += share * (62 + 14 * std::sin(phase));
        a.arm_swing[side] += share * (14 + 5 * std::sin(0.5 * phase + 1));
        a.arm_lower[side] -= share * (6 + 4 * std::sin(0.7 * phase));
        a.arm_twist[side] += share * (-6 + 16 * std::sin(phase + 2));
        a.wrist[side] += share * 10 * std::sin(phase - 0.6);
    }
    return p;
}

Posture touch_chin(const Moment& m) {
    Posture p = standing(m);
    const double share = m.between(0.1, m.duration, 0.9);
    const std::size_t side = m.side();
    p.angles.elbow[side] += 100 * share;
    p.angles.arm_swing[side] += 30 * share;
    p.angles.arm_twist[side] += 25 * share;
    p.angles.head_pitch += 8 * share;
    lay_hand(p, side, index_of(Part::head), {30, 1528, 92}, {-0.2, 0.6, -0.75}, share);
    return p;
}

Posture fold_hands(const Moment& m) {
    Posture p = standing(m);
    const std::size_t over = m.side();
    for (std::size_t side = 0; side < 2; ++side) {
        const double share = m.between(side == over ? 0.25 : 0.1, m.duration - (side == over ? 0.15 : 0.0), 0.8);
        p.angles.elbow[side] += 60 * share;
        p.angles.arm_twist[side] += 40 * share;
        p.angles.arm_lower[side] -= 8 * share;
        if (side == over)
            lay_hand(p, side, index_of(Part::pelvis), {8, 1035, 130}, {-0.1, 0, -1}, share);
        else
            lay_hand(p, side, index_of(Part::pelvis), {38, 1005, 120}, {-0.3, 0, -1}, share);
        if (side == over) p.holds[side].clearance = 58;
    }
    look(p, m, m.drawn(0, -25, 25), 0);
    return p;
}

Posture hands_on_hips(const Moment& m) {
    Posture p = standing(m);
    for (std::size_t side = 0; side < 2; ++side) {
        const double share = m.between(0.1 + 0.15 * static_cast<double>(side), m.duration, 0.8);
        p.angles.elbow[side] += 75 * share;
        p.angles.arm_twist[side] += 40 * share;
        p.angles.arm_lower[side] -= 32 * share;
        p.angles.arm_swing[side] -= 14 * share;
        lay_hand(p, side, index_of(Part::pelvis), {170, 1000, 28}, {-1, 0, -0.1}, share);
    }
    look(p, m, m.drawn(0, -30, 30), 0);
    return p;
}

Posture hold_arm(const Moment& m) {
    Posture p = standing(m);
    const std::size_t side = m.side();
    const double share = m.between(0.1, m.duration, 0.8);
    p.angles.elbow[side] += 70 * share;
    p.angles.arm_twist[side] += 50 * share;
    p.angles.arm_swing[side] += 18 * share;
    // On the other arm, whose rest coordinates lie on the other side; its front when it hangs.
    const std::size_t part = index_of(Part::left_forearm) + (1 - side);
    const double rub = 14 * std::sin(full_turn * 0.8 * m.local);
    lay_hand(p, side, part, {-(510 + rub), 1395, 40}, {0, 0, -1}, share);
    p.angles.elbow[1 - side] += 26 * share;
    p.angles.arm_twist[1 - side] += 24 * share;
    look(p, m, m.drawn(0, -20, 20), 4);
    return p;
}

// ---- Everyday -------------------------------------------------------------------------------------------------------

constexpr double walk_radius = 750.0;  // mm

// A round that ends where it began, to the left.
Posture walk_round(const Moment& m) {
    constexpr double ramp = 0.7;
    const double around = full_turn * walk_radius, speed = around / (m.duration - ramp);
    const auto walked_by = [&](double t) { return speed * ramp * smooth_step_integral(t / ramp); };
    const double walked = walked_by(m.local) - walked_by(m.local - (m.duration - ramp));
    const double share = smooth_step(m.local / ramp) - smooth_step((m.local - (m.duration - ramp)) / ramp);
    Posture p;
    add_weighted(p.angles, 1 - share, stand(m.seconds));
    add_weighted(p.angles, share, walk(m.seconds, walked));
    const double heading = walked / walk_radius;
    p.turned = heading * 360 / full_turn;
    p.moved = {walk_radius * (1 - std::cos(heading)), 0, walk_radius * std::sin(heading)};
    return p;
}

Posture stroll(const Moment& m) {
    Posture p = walk_round(m);
    const double share = m.between(0.2, m.duration - 0.1, 0.6);
    for (std::size_t side = 0; side < 2; ++side) put_in_pocket(p, side, share);
    return p;
}

Posture hands_in_pockets(const Moment& m) {
    Posture p = standing(m);
    for (std::size_t side = 0; side < 2; ++side)
        put_in_pocket(p, side, m.between(0.1 + 0.3 * static_cast<double>(side == m.side()), m.duration - 0.1, 0.7));
    look(p, m, m.drawn(0, -35, 35), m.drawn(1, -5, 10));
    return p;
}

Posture wave(const Moment& m) {
    Posture p = standing(m);
    const std::size_t side = m.side();
    const double share = m.between(0.05, m.duration, 0.5), beat = full_turn * 1.5 * m.local;
    Angles& a = p.angles;
    a.arm_lower[side] += share * (-92 + 4 * std::sin(beat));
    a.arm_swing[side] += share * 8;
    a.arm_twist[side] += share * -88;
    a.elbow[side] += share * (56 + 25 * std::sin(beat));
    look(p, m, -14 * sign_of(side), 0);
    return p;
}

// Where the chair and the ball are when the person has turned to the middle of the round: its place behind, and ahead.
constexpr double chair_step = 270, chair_behind = 375, ball_ahead = 365;  // mm

// Turns to the middle of the round, and back at the end.
void face_middle(Posture& p, const Moment& m, double share_of_step) {
    constexpr double time = 1.1;
    const double there = smooth_step(m.local / time), back = smooth_step((m.at_end()) / time);
    p.turned = 90 * std::min(there, back);
    p.moved = {-chair_step * share_of_step * std::min(there, back), 0, 0};
    const double turning = std::max(bump(m.local, 0, time + 0.1), bump(m.at_end(), 0, time + 0.1));
    step_on_the_spot(p.angles, m.local, turning);
}

Posture sit(const Moment& m) {
    Posture p = standing(m);
    constexpr double turning = 1.1, lowering = 1.15;
    const double down = smooth_step((m.local - turning) / lowering) * smooth_step((m.at_end() - turning) / lowering);
    const double leaning = 4 * down * (1 - down);
    Angles& a = p.angles;
    a.spine_pitch += 34 * leaning + 3 * down;
    a.head_pitch -= 16 * leaning;
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += 81 * down;
        a.knee[side] += 79 * down + 14 * leaning;
        a.hip_spread[side] += 5 * down;
        a.arm_swing[side] += 26 * leaning + 8 * down;
        a.elbow[side] += 40 * down;
    }
    level_feet(a);
    face_middle(p, m, 1.0);
    const double seated = turning + lowering;
    for (std::size_t side = 0; side < 2; ++side) {
        const double late = 0.3 * static_cast<double>(side == m.side());
        const double share = m.between(seated - 0.5 + late, m.duration - seated + 0.5, 0.6);
        lay_hand(p, side, index_of(Part::left_thigh) + side, {100, 590, 60}, {0, 0, -1}, share);
    }
    Moment while_seated = m;
    while_seated.local = m.local - seated;
    while_seated.duration = m.duration - 2 * seated;
    if (while_seated.local > 0 && while_seated.at_end() > 0)
        look(p, while_seated, m.drawn(0, -40, 40), m.drawn(1, -6, 10));
    return p;
}

Posture pick_up_ball(const Moment& m) {
    Posture p = standing(m);
    constexpr double turning = 1.1, going_down = 1.0, pause = 0.25;
    const double grip = turning + going_down + pause, release = m.duration - grip;
    // Down at both ends of the time in which the hands have the ball.
    const auto crouched = [&](double begin, double until) {
        return smooth_step((m.local - begin) / going_down) * smooth_step((until - m.local) / going_down);
    };
    const double down = std::max(crouched(turning, grip + pause + going_down),
                                 crouched(release - pause - going_down, m.duration - turning));
    Angles& a = p.angles;
    a.pelvis_pitch += 50 * down;
    a.spine_pitch += 40 * down;
    a.head_pitch -= 30 * down;
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += 97 * down;
        a.knee[side] += 57 * down;
        a.hip_spread[side] += 6 * down;
        a.arm_swing[side] += 78 * down;
        a.elbow[side] += 20;
    }
    level_feet(a);
    face_middle(p, m, 0.0);
    const double carried =
        smooth_step((m.local - grip - 0.05) / going_down) * smooth_step((release - m.local) / going_down);
    const double toss = std::sin(full_turn * 0.7 * (m.local - grip));
    // While the person faces the middle, which is to the left of where the move began.
    p.ball = {carried * (-40 + 20 * toss), carried * (930 + 70 * toss),
              carried * 60 * std::sin(full_turn * 0.45 * (m.local - grip))};
    for (std::size_t side = 0; side < 2; ++side) {
        const double share =
            smooth_step((m.local - (grip - 0.8)) / 0.75) * smooth_step((release + 0.8 - m.local) / 0.75);
        lay_hand(p, side, ball_part, {ball_radius, 14, -20}, {-1, 0, 0}, share);
        a.elbow[side] += 30 * share * (1 - down);
        a.arm_swing[side] += 26 * share * (1 - down);
    }
    return p;
}

// ---- Fast -----------------------------------------------------------------------------------------------------------

Posture groove(const Moment& m) {
    Posture p = standing(m);
    const double share = m.between(0, m.duration, 0.2), beat = full_turn * m.local / 0.5;
    const double dip = 0.5 - 0.5 * std::cos(beat), turn = std::sin(beat / 2);
    Angles& a = p.angles;
    a.spine_yaw += 24 * share * turn;
    a.pelvis_yaw -= 12 * share * turn;
    a.spine_pitch += 8 * share * dip;
    a.head_yaw -= 14 * share * turn;
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += share * (6 + 26 * dip);
        a.knee[side] += share * (12 + 48 * dip);
        a.hip_spread[side] += 7 * share;
        a.elbow[side] += share * 76;
        a.arm_swing[side] += share * (20 + 52 * sign_of(static_cast<std::size_t>(side)) * turn);
        a.arm_lower[side] -= 10 * share;
        a.arm_twist[side] += 12 * share;
    }
    level_feet(a);
    return p;
}

Posture jumping_jacks(const Moment& m) {
    Posture p = standing(m);
    const double period = m.drawn(0, 0.50, 0.60), jacks = std::max(1.0, std::floor((m.duration - 0.2) / period));
    const double phase = std::clamp((m.local - 0.1) / period, 0.0, jacks);
    const double open = 0.5 - 0.5 * std::cos(full_turn * phase), air = std::pow(std::sin(full_turn * phase), 2);
    Angles& a = p.angles;
    for (int side = 0; side < 2; ++side) {
        a.arm_lower[side] += open * -152;
        a.hip_spread[side] += 20 * open;
        a.knee[side] += 24 * (1 - air) * std::min(1.0, 4 * phase) * std::min(1.0, 4 * (jacks - phase));
        a.hip_flex[side] += 12 * (1 - air) * std::min(1.0, 4 * phase) * std::min(1.0, 4 * (jacks - phase));
        a.elbow[side] -= 6 * open;
    }
    level_feet(a);
    for (int side = 0; side < 2; ++side) a.ankle[side] -= 22 * air;
    a.lift = 95 * air;
    return p;
}

Posture kick(const Moment& m) {
    Posture p = standing(m);
    const auto foot = static_cast<int>(m.side()), other = 1 - foot;
    const double height = m.drawn(0, 72, 96), spread = m.drawn(1, 0, 26);
    const double back = bump(m.local, 0.0, 0.36),
                 up = smooth_step((m.local - 0.2) / 0.2) * smooth_step((0.74 - m.local) / 0.24);
    Angles& a = p.angles;
    a.hip_flex[foot] += -22 * back + height * up;
    a.knee[foot] += 80 * back;
    a.hip_spread[foot] += spread * up;
    a.ankle[foot] -= 30 * up;
    a.knee[other] += 16 * up + 10 * back;
    a.hip_flex[other] += 8 * up + 8 * back;
    a.ankle[other] += 8 * up + 2 * back;
    a.spine_pitch += -10 * up + 6 * back;
    a.pelvis_roll += 4 * up * sign_of(static_cast<std::size_t>(foot));
    a.arm_swing[other] += 62 * up - 24 * back;
    a.arm_swing[foot] += -34 * up + 30 * back;
    for (int side = 0; side < 2; ++side) {
        a.elbow[side] += 40 * (up + back);
        a.arm_lower[side] -= 22 * up;
    }
    const double share = m.between(0, 0.86, 0.16);
    p.left_weight = 0.5 + 0.5 * share * (foot == 0 ? -1 : 1);
    return p;
}

Posture spin(const Moment& m) {
    Posture p = standing(m);
    const double begin = 0.16, time = m.duration - 0.26, u = (m.local - begin) / time;
    const std::size_t side = m.side();
    const double share = m.between(0.02, m.duration + 0.04, 0.2);
    p.turned = sign_of(side) * 360 * smooth_step(u);
    Angles& a = p.angles;
    for (int arm = 0; arm < 2; ++arm) {
        a.arm_lower[arm] += share * -66;
        a.elbow[arm] -= share * 4;
    }
    a.hip_flex[side] += 34 * share;
    a.knee[side] += 66 * share;
    a.ankle[side] -= 20 * share;
    p.left_weight = 0.5 + 0.5 * share * (side == 0 ? -1 : 1);
    return p;
}

// Hands to the opposite shoulders, one arm over the other, and thrown out wide.
Posture cross_and_throw(const Moment& m) {
    Posture p = standing(m);
    const std::size_t over = m.side();
    const double dip = m.between(0, m.duration, 0.3);
    Angles& a = p.angles;
    const double crossed = m.between(0.0, m.duration - 0.5, 0.24),
                 thrown = m.between(m.duration - 0.56, m.duration + 0.1, 0.2);
    for (std::size_t side = 0; side < 2; ++side) {
        a.elbow[side] += 95 * crossed - 8 * thrown;
        a.arm_swing[side] += 52 * crossed;
        a.arm_twist[side] += 30 * crossed;
        a.arm_lower[side] += -88 * thrown - 8 * crossed;
        a.hip_flex[side] += 14 * dip;
        a.knee[side] += 26 * dip;
        a.hip_spread[side] += 6 * dip;
        const bool outer = side == over;
        lay_hand(p, side, index_of(Part::chest), {-118, outer ? 1330.0 : 1365.0, 80}, {0.1, 0, -1}, crossed);
        if (outer) p.holds[side].clearance = 24;
    }
    level_feet(a);
    a.spine_pitch += 10 * crossed - 8 * thrown;
    return p;
}

// Knees lifted in turn, each met by the opposite hand.
Posture slap_knees(const Moment& m) {
    Posture p = standing(m);
    const double period = m.drawn(0, 0.46, 0.56), knees = std::max(1.0, std::floor((m.duration - 0.1) / period));
    const double phase = std::clamp(m.local / period, 0.0, knees);
    const double within = phase - std::floor(phase),
                 up = phase < knees ? 0.5 - 0.5 * std::cos(full_turn * within) : 0.0;
    const std::size_t knee = (m.side() + static_cast<std::size_t>(phase)) & 1, hand = 1 - knee;
    Angles& a = p.angles;
    a.hip_flex[knee] += 92 * up;
    a.knee[knee] += 96 * up;
    a.hip_flex[hand] += 6 * up;
    a.knee[hand] += 12 * up;
    a.ankle[hand] += 6 * up;
    a.spine_pitch += 14 * up;
    a.spine_yaw += 12 * up * sign_of(knee);
    a.arm_swing[hand] += 34 * up;
    a.elbow[hand] += 30 * up;
    a.arm_swing[knee] += -30 * up;
    a.arm_lower[knee] += -16 * up;
    a.elbow[knee] += 40 * up;
    lay_hand(p, hand, index_of(Part::left_thigh) + knee, {-102, 545, 70}, {0, 0, -1}, smooth_step(1.3 * up - 0.15));
    p.left_weight = 0.5 + 0.5 * std::min(1.0, 2 * up) * (knee == 0 ? -1 : 1);
    return p;
}

Posture jump_and_turn(const Moment& m) {
    Posture p = standing(m);
    constexpr double take_off = 0.34, landing = take_off + 0.5;
    const double crouch = bump(m.local, 0.0, take_off + 0.04) + 0.7 * bump(m.local, landing - 0.06, landing + 0.4);
    const double air = bump(m.local, take_off - 0.06, landing + 0.06),
                 flight = (m.local - take_off) / (landing - take_off);
    Angles& a = p.angles;
    a.spine_pitch += 22 * crouch;
    a.head_pitch -= 10 * crouch;
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += 52 * crouch;
        a.knee[side] += 80 * crouch;
        a.arm_swing[side] += -40 * crouch + 60 * air;
        a.arm_lower[side] -= 44 * air;
        a.elbow[side] += 20 * crouch + 34 * air;
    }
    level_feet(a);
    for (int side = 0; side < 2; ++side) {
        a.hip_flex[side] += 46 * air;
        a.knee[side] += 74 * air;
        a.ankle[side] -= 18 * air;
        a.hip_spread[side] += 8 * air;
    }
    if (flight > 0 && flight < 1) a.lift = 4 * 320.0 * flight * (1 - flight);
    p.turned = sign_of(m.side()) * (random_uniform(m.key, 0) < 0.5 ? 180 : 360) *
               smooth_step((m.local - take_off + 0.06) / 0.6);
    return p;
}

Posture punch(const Moment& m) {
    Posture p = standing(m);
    const double period = m.drawn(0, 0.30, 0.38), punches = std::max(2.0, std::floor((m.duration - 0.3) / period));
    const double guard = m.between(0, m.duration, 0.2), phase = std::clamp((m.local - 0.15) / period, 0.0, punches);
    const double out = phase < punches ? std::pow(std::sin(std::numbers::pi * (phase - std::floor(phase))), 2) : 0.0;
    const std::size_t hand = (m.side() + static_cast<std::size_t>(phase)) & 1;
    Angles& a = p.angles;
    for (std::size_t side = 0; side < 2; ++side) {
        const double reaching = side == hand ? out : 0.0;
        a.elbow[side] += guard * 104 - reaching * 106;
        a.arm_swing[side] += guard * 34 + reaching * 44;
        a.arm_twist[side] += guard * 8;
        a.hip_flex[side] += 14 * guard;
        a.knee[side] += 28 * guard;
        a.hip_spread[side] += 7 * guard;
    }
    level_feet(a);
    a.spine_yaw -= 26 * out * sign_of(hand);
    a.head_yaw += 20 * out * sign_of(hand);
    return p;
}

Posture arm_over_head(const Moment& m) {
    Posture p = standing(m);
    const std::size_t side = m.side();
    const double up = smooth_step(m.local / 0.3) * smooth_step((m.duration - m.local) / 0.3);
    const double lunge = m.between(0, m.duration, 0.3);
    Angles& a = p.angles;
    a.arm_swing[side] += 168 * up;
    a.elbow[side] -= 6 * up;
    a.arm_swing[1 - side] -= 46 * up;
    a.arm_lower[1 - side] -= 24 * up;
    a.hip_spread[side] += 20 * lunge;
    a.hip_flex[1 - side] += 44 * lunge;
    a.knee[1 - side] += 62 * lunge;
    a.hip_spread[1 - side] += 12 * lunge;
    a.spine_roll += 8 * lunge * sign_of(side);
    level_feet(a);
    return p;
}

// ---- Which moves follow which ---------------------------------------------------------------------------------------

constexpr std::array<MoveKind, 6> calm_moves = {{{2.5, 4.5, look_about},
                                                 {3.0, 5.5, talk},
                                                 {3.2, 5.0, touch_chin},
                                                 {3.5, 6.0, fold_hands},
                                                 {3.5, 6.0, hands_on_hips},
                                                 {3.2, 4.8, hold_arm}}};
constexpr std::array<MoveKind, 7> everyday_moves = {{{4.4, 5.6, walk_round},
                                                     {5.0, 6.2, stroll},
                                                     {3.6, 5.0, hands_in_pockets},
                                                     {7.5, 10.5, sit},
                                                     {7.6, 9.4, pick_up_ball},
                                                     {2.6, 3.6, wave},
                                                     {2.5, 4.0, talk}}};
constexpr std::array<MoveKind, 5> visitor_moves = {
    {{2.5, 4.0, talk}, {2.4, 3.4, wave}, {3.0, 4.5, fold_hands}, {3.0, 4.5, hands_on_hips}, {2.5, 3.5, look_about}}};
constexpr std::array<MoveKind, 9> fast_moves = {{{1.0, 1.6, groove},
                                                 {1.3, 2.0, jumping_jacks},
                                                 {0.86, 0.92, kick},
                                                 {0.78, 0.95, spin},
                                                 {1.1, 1.4, cross_and_throw},
                                                 {1.2, 2.1, slap_knees},
                                                 {1.2, 1.25, jump_and_turn},
                                                 {1.1, 1.9, punch},
                                                 {0.9, 1.2, arm_over_head}}};

std::span<const MoveKind> moves_of(SynthMotion motion, bool visitor) {
    if (motion == SynthMotion::fast) return fast_moves;
    if (motion == SynthMotion::everyday && !visitor) return everyday_moves;
    if (motion == SynthMotion::everyday) return visitor_moves;
    return calm_moves;
}

struct Move {
    const MoveKind* kind = nullptr;
    double begin = 0, duration = 0;  // s
    RandomKey key;
};

// The move at a time and the one before it. All kinds of moves come once, in an order drawn anew, before any comes
// again.
struct TwoMoves {
    Move before, now;
    double heading = 0;  // degrees, as the present one begins
};

Posture posture_at(const Move& move, double seconds) {
    return move.kind->at({seconds, seconds - move.begin, move.duration, move.key});
}

TwoMoves moves_at(std::span<const MoveKind> kinds, RandomKey key, double seconds) {
    TwoMoves moves;
    std::vector<std::size_t> order(kinds.size());
    double begin = 0;
    for (std::uint64_t round = 0;; ++round) {
        const std::size_t last = round == 0 ? kinds.size() : order.back();
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        const RandomKey drawn = derive_key(key, round);
        for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random_bits(drawn, i) % (i + 1)]);
        if (order.front() == last) std::swap(order.front(), order.back());
        for (std::size_t i = 0; i < order.size(); ++i) {
            moves.before = moves.now;
            if (moves.before.kind) moves.heading += posture_at(moves.before, begin).turned;
            Move& move = moves.now;
            move.kind = &kinds[order[i]];
            move.key = derive_key(drawn, 100 + i);
            move.begin = begin;
            move.duration =
                move.kind->shortest + (move.kind->longest - move.kind->shortest) * random_uniform(move.key, 1000);
            begin += move.duration;
            if (begin > seconds) return moves;
        }
    }
}

// ---- The scene ------------------------------------------------------------------------------------------------------

struct Actor {
    std::size_t first_part = 0;  // 0 or second_person
    std::span<const MoveKind> moves;
    RandomKey key;
    double fade = 0.3;                  // s, over which a move goes over into the next
    Vector3d place = Vector3d::Zero();  // mm, where the feet are
    double heading = 0;                 // degrees
    double walked = 0, walking = 0;     // mm on the way in, and how much of the gait there is
};

Posture blend(const Posture& a, const Posture& b, double share) {
    Posture out;
    add_weighted(out.angles, 1 - share, a.angles);
    add_weighted(out.angles, share, b.angles);
    out.left_weight = (1 - share) * a.left_weight + share * b.left_weight;
    for (std::size_t side = 0; side < 2; ++side)
        out.in_pocket[side] = (1 - share) * a.in_pocket[side] + share * b.in_pocket[side];
    return out;
}

// Puts the pockets over the hands that are in them, and into the legs where none is.
void place_pockets(PosedScene& scene, const Posture& posture) {
    for (std::size_t side = 0; side < 2; ++side) {
        const double s = sign_of(side);
        const Matrix3d half_thigh =
            about_x(-0.5 * posture.angles.hip_flex[side]) * about_z(0.5 * s * posture.angles.hip_spread[side]);
        PartFrame& pocket = scene.parts[left_pocket + side];
        pocket = attach(scene.parts[index_of(Part::pelvis)], rest_joints()[9 + 3 * side], half_thigh);
        pocket.pivot -= pocket.rotation * Vector3d(s * 70 * (1 - posture.in_pocket[side]), 0, 0);
        scene.present |= part_bit(left_pocket + side);
    }
}

// Stands the body on the floor, with the feet where the actor stands.
void ground(PosedBody& body, const Posture& posture, const Vector3d& place, const Matrix3d& facing) {
    Vector3d shift = place;
    for (std::size_t side = 0; side < 2; ++side) {
        const double weight = side == 0 ? posture.left_weight : 1 - posture.left_weight;
        const Vector3d stance = facing * Vector3d(sign_of(side) * 121, 0, 0);  // the ankles of stand()
        shift += weight * (stance - body.joints[11 + 3 * side]);
    }
    shift.y() = posture.angles.lift - lowest_sole(body);
    shift_body(body, shift);
}

void place_things(PosedScene& scene, const Vector3d& ball_moved) {
    PartFrame chair;
    chair.rotation = about_y(90);
    chair.pivot = {-chair_step - chair_behind, 0, 0};
    scene.parts[chair_seat] = scene.parts[chair_frame] = chair;
    scene.parts[ball_part].pivot = Vector3d(ball_ahead, ball_radius, 0) + ball_moved;
    scene.parts[ball_part].rotation = about_y(90) * about_z(20);
    scene.present |= part_bit(chair_seat) | part_bit(chair_frame) | part_bit(ball_part);
    for (const double x : {-200.0, 200.0})
        for (const double z : {-300.0, 200.0})
            for (const double y : {0.0, 880.0}) scene.landmarks.push_back(carry(chair, {x, y, z}));
    scene.landmarks.push_back(scene.parts[ball_part].pivot);
}

void place_actor(PosedScene& scene, const Actor& actor, double seconds, bool with_things) {
    const TwoMoves moves = moves_at(actor.moves, actor.key, seconds);
    const Posture now = posture_at(moves.now, seconds);
    const double share = moves.before.kind ? smooth_step((seconds - moves.now.begin) / actor.fade) : 1.0;
    const Posture before = share < 1 ? posture_at(moves.before, seconds) : now;
    Posture posture = blend(before, now, share);
    if (actor.walking > 0) {
        Angles gait;
        add_weighted(gait, 1 - actor.walking, posture.angles);
        add_weighted(gait, actor.walking, walk(seconds, actor.walked));
        posture.angles = gait;
    }
    const double heading = actor.heading + moves.heading;
    const Matrix3d begun = about_y(heading), facing = about_y(heading + now.turned);
    PosedBody body = place_body(posture.angles, facing);
    ground(body, posture, actor.place + begun * now.moved, facing);
    std::ranges::copy(body.parts, scene.parts.begin() + static_cast<std::ptrdiff_t>(actor.first_part));
    scene.landmarks.insert(scene.landmarks.end(), body.joints.begin(), body.joints.end());
    scene.present |= person_parts << actor.first_part;
    if (actor.first_part == 0) place_pockets(scene, posture);
    if (with_things) place_things(scene, begun * now.ball);
    Holds holds;
    for (std::size_t side = 0; side < 2; ++side) {
        holds[side] = {before.holds[side], now.holds[side]};
        holds[side][0].weight *= (1 - share) * (1 - actor.walking);
        holds[side][1].weight *= share * (1 - actor.walking);
        for (Hold& hold : holds[side])
            if (hold.part < part_count) hold.part += actor.first_part;
    }
    reach(scene, actor.first_part, holds, posture.in_pocket);
    std::ranges::copy_n(scene.parts.begin() + static_cast<std::ptrdiff_t>(actor.first_part), part_count,
                        body.parts.begin());
    place_joints(body);
    if (actor.first_part == 0) scene.joints = body.joints;
}

// The second person of everyday: comes in from the left of the scene, stays for a while, and goes again. Nothing while
// away.
bool visiting(Actor& visitor, double seconds) {
    constexpr double away = 7, way_in = 2.2, stay = 10, cycle = away + 2 * way_in + stay, way = 1900, ramp = 0.6;
    const double local = std::fmod(seconds, cycle) - away;
    if (local < 0) return false;
    const double speed = way / (way_in - ramp / 2);
    const auto covered = [&](double t) {  // on the way in: at speed until the ramp, in which the pace falls to zero
        return speed * (t - ramp * smooth_step_integral((t - way_in + ramp) / ramp));
    };
    const double turned_at = way_in + stay;
    const double coming = local < way_in ? covered(local) : way,
                 going = local > turned_at ? way - covered(way_in - (local - turned_at)) : 0;
    visitor.walked = coming + going;
    visitor.walking =
        local < turned_at ? 1 - smooth_step((local - way_in + ramp) / ramp) : smooth_step((local - turned_at) / ramp);
    visitor.place.x() += way - coming + going;
    visitor.heading += 180 * smooth_step((local - turned_at + 0.9) / 0.9);
    return true;
}

}  // namespace

PosedScene pose_scene(SynthMotion motion, int people, std::uint64_t seed, double seconds) {
    if (motion == SynthMotion::tour) return scene_of(pose_body(seconds));
    const RandomKey key = derive_key({mix_bits(seed)}, 0x6d6f7665);
    const double fade = motion == SynthMotion::fast ? 0.12 : 0.35;
    const bool everyday = motion == SynthMotion::everyday;
    PosedScene scene;
    place_actor(scene, {0, moves_of(motion, false), derive_key(key, 0), fade, Vector3d::Zero(), 0}, seconds, everyday);

    const double apart = everyday ? 2300 : motion == SynthMotion::fast ? 2000 : 1000;  // mm
    Actor second = {second_person, moves_of(motion, true), derive_key(key, 1), fade, {apart, 0, 150}, -90};
    if (everyday) scene.border = 3100;
    if (people > 1 || (everyday && visiting(second, seconds))) place_actor(scene, second, seconds, false);
    return scene;
}

}  // namespace htvm::synth
