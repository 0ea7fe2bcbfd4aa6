#include "synth/arms.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "synth/body.h"
#include "synth/posture.h"

namespace htvm::synth {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The middle of the hand in rest coordinates, between the knuckles.
Vector3d hand_centre(std::size_t side) { return {side == 0 ? 800.0 : -800.0, 1394, 0}; }

struct Arm {
    PartFrame *upper, *fore, *hand;
};

Arm arm_of(PosedScene& scene, std::size_t first_part, std::size_t side) {
    const auto part = [&](Part left) { return &scene.parts[first_part + index_of(left) + side]; };
    return {part(Part::left_upper_arm), part(Part::left_forearm), part(Part::left_hand)};
}

Matrix3d axes(const Vector3d& along, const Vector3d& across) {
    Matrix3d out;
    out.col(0) = along.normalized();
    out.col(2) = (across - across.dot(out.col(0)) * out.col(0)).normalized();
    out.col(1) = out.col(2).cross(out.col(0));
    return out;
}

// Turns upper arm and forearm so that the middle of the hand comes to `target`, or as near as the arm is long; the
// elbow goes to the side where `elbow` is.
void bend(const Arm& arm, std::size_t side, const Vector3d& target, const Vector3d& elbow) {
    const Vector3d shoulder = arm.upper->pivot, joint = arm.fore->pivot, end = carry(*arm.hand, hand_centre(side));
    const double upper = (joint - shoulder).norm(), fore = (end - joint).norm();
    Vector3d way = target - shoulder;
    const double distance = std::clamp(way.norm(), 0.45 * (upper + fore), 0.995 * (upper + fore));
    way.normalize();
    const double along = (upper * upper - fore * fore + distance * distance) / (2 * distance);
    const double height = std::sqrt(std::max(0.0, upper * upper - along * along));
    Vector3d pole = elbow - shoulder;
    pole -= pole.dot(way) * way;
    if (pole.norm() < 1e-6) return;
    const Vector3d new_joint = shoulder + along * way + height * pole.normalized();
    const Vector3d new_end = shoulder + distance * way;
    const Vector3d hinge = (joint - shoulder).cross(end - joint);
    const Vector3d new_hinge = (new_joint - shoulder).cross(new_end - new_joint);
    if (hinge.norm() < 1e-3 || new_hinge.norm() < 1e-3) return;
    const Matrix3d turn_upper = axes(new_joint - shoulder, new_hinge) * axes(joint - shoulder, hinge).transpose();
    const Matrix3d turn_fore = axes(new_end - new_joint, new_hinge) * axes(end - joint, hinge).transpose();
    arm.hand->rotation = turn_fore * arm.hand->rotation;
    arm.hand->pivot = new_joint + turn_fore * (arm.hand->pivot - joint);
    arm.fore->rotation = turn_fore * arm.fore->rotation;
    arm.fore->pivot = new_joint;
    arm.upper->rotation = turn_upper * arm.upper->rotation;
}

// Turns the hand about the forearm's axis so that the palm faces `inwards` (world), as far as a wrist turns; half of it
// is done by the forearm.
void turn_palm(const Arm& arm, std::size_t side, const Vector3d& inwards, double weight) {
    const Vector3d axis = (carry(*arm.hand, hand_centre(side)) - arm.hand->pivot).normalized();
    const auto flat = [&](const Vector3d& v) { return Vector3d(v - v.dot(axis) * axis); };
    const Vector3d palm = flat(arm.hand->rotation * Vector3d(0, -1, 0)), wanted = flat(inwards);
    if (palm.norm() < 0.1 || wanted.norm() < 0.1) return;
    const double angle = std::atan2(axis.dot(palm.cross(wanted)), palm.dot(wanted));
    constexpr double farthest = 1.7;  // radians
    // Beyond the farthest turn the angle goes back, so that it does not jump where it changes sign.
    const double bounded =
        std::abs(angle) <= farthest
            ? angle
            : std::copysign((std::numbers::pi - std::abs(angle)) * farthest / (std::numbers::pi - farthest), angle);
    const auto about = [&](double radians) { return Eigen::AngleAxisd(radians, axis).toRotationMatrix(); };
    arm.hand->rotation = about(weight * bounded) * arm.hand->rotation;
    arm.fore->rotation = about(0.5 * weight * bounded) * arm.fore->rotation;
}

// Bends the wrist so that the palm lies flat, as far as it goes.
void lay_palm(const Arm& arm, const Vector3d& inwards, double weight) {
    const Vector3d palm = arm.hand->rotation * Vector3d(0, -1, 0);
    const Vector3d axis = palm.cross(inwards);
    if (axis.norm() < 1e-6) return;
    constexpr double farthest = 1.2;  // radians
    const double angle = std::atan2(axis.norm(), palm.dot(inwards));
    const double bounded = std::min(angle, farthest) * std::clamp((std::numbers::pi - angle) / 0.8, 0.0, 1.0);
    arm.hand->rotation = Eigen::AngleAxisd(weight * bounded, axis.normalized()).toRotationMatrix() * arm.hand->rotation;
}

// Turns the hand on its palm so that the fingers point along `fingers`.
void point_fingers(const Arm& arm, std::size_t side, const Vector3d& inwards, const Vector3d& fingers, double weight) {
    const auto flat = [&](const Vector3d& v) { return Vector3d(v - v.dot(inwards) * inwards); };
    const Vector3d now = flat(arm.hand->rotation * Vector3d(side == 0 ? 1 : -1, 0, 0)), wanted = flat(fingers);
    if (now.norm() < 0.1 || wanted.norm() < 0.1) return;
    const double angle = std::atan2(inwards.dot(now.cross(wanted)), now.dot(wanted));
    constexpr double farthest = 1.2;  // radians
    arm.hand->rotation =
        Eigen::AngleAxisd(weight * std::clamp(angle, -farthest, farthest), inwards).toRotationMatrix() *
        arm.hand->rotation;
}

// Where the middle of the hand is when it lies on the part.
Vector3d hold_point(const PosedScene& scene, const Hold& hold) {
    Vector3d place = hold.place;
    for (int round = 0; round < 8; ++round) place += (part_distance(hold.part, place) - hold.clearance) * hold.inwards;
    return carry(scene.parts[hold.part], place);
}

// How far a ball reaches into other parts, as the way out of the deepest one.
Vector3d way_out(const PosedScene& scene, PartSet obstacles, const Vector3d& centre, double radius) {
    Vector3d way = Vector3d::Zero();
    double deepest = 0;
    for (std::size_t part = 0; part < scene_part_count; ++part) {
        if (!(obstacles & part_bit(part))) continue;
        const PartFrame& frame = scene.parts[part];
        const auto distance_at = [&](const Vector3d& world) {
            return part_distance(part, frame.rotation.transpose() * (world - frame.pivot) + frame.rest_pivot);
        };
        const double distance = distance_at(centre), depth = radius - distance;
        if (depth <= deepest) continue;
        Vector3d gradient;
        for (int axis = 0; axis < 3; ++axis) gradient[axis] = distance_at(centre + Vector3d::Unit(axis)) - distance;
        if (gradient.norm() < 1e-6) continue;
        deepest = depth;
        way = depth * gradient.normalized();
    }
    return way;
}

struct Ball {
    Part part;
    double x, z, radius;  // rest coordinates, left
};
// The arm as balls, from the elbow to the finger tips; the hand is as thick as its palm.
constexpr std::array<Ball, 11> arm_balls = {{{Part::left_forearm, 470, 0, 42},
                                             {Part::left_forearm, 540, 0, 41},
                                             {Part::left_forearm, 600, 0, 36},
                                             {Part::left_forearm, 660, 0, 32},
                                             {Part::left_forearm, 705, 0, 28},
                                             {Part::left_hand, 745, 0, 20},
                                             {Part::left_hand, 790, 24, 17},
                                             {Part::left_hand, 790, -24, 17},
                                             {Part::left_hand, 840, 0, 11},
                                             {Part::left_hand, 868, 13, 10},
                                             {Part::left_hand, 790, 58, 11}}};

PartSet obstacles_of(const PosedScene& scene, std::size_t first_part, std::size_t side) {
    const auto bit_of = [&](Part part, std::size_t of_side = 0) {
        return part_bit(first_part + index_of(part) + of_side);
    };
    PartSet parts = scene.present &
                    (person_parts << first_part | part_bit(chair_seat) | part_bit(chair_frame) | part_bit(ball_part));
    for (const Part own : {Part::left_upper_arm, Part::left_forearm, Part::left_hand}) {
        parts &= ~bit_of(own, side);
        if (side == 0) parts &= ~bit_of(own, 1);
    }
    return parts;
}

void push_out(PosedScene& scene, std::size_t first_part, std::size_t side, PartSet obstacles, double in_pocket) {
    const Arm arm = arm_of(scene, first_part, side);
    for (int round = 0; round < 10; ++round) {
        Vector3d hand_way = Vector3d::Zero(), elbow_way = Vector3d::Zero();
        for (const Ball& of_arm : arm_balls) {
            const double x = side == 0 ? of_arm.x : -of_arm.x;
            const PartFrame& frame = scene.parts[first_part + index_of(of_arm.part) + side];
            const double radius = of_arm.radius - 3 - (of_arm.x > 600 ? 90 * in_pocket : 0.0);
            const Vector3d way = way_out(scene, obstacles, carry(frame, {x, 1394, of_arm.z}), radius);
            const double share = std::clamp((of_arm.x - 470) / 330, 0.0, 1.0);
            if (share * way.norm() > hand_way.norm()) hand_way = share * way;
            if ((1 - share) * way.norm() > elbow_way.norm()) elbow_way = (1 - share) * way;
        }
        if (hand_way.norm() < 0.5 && elbow_way.norm() < 0.5) return;
        const Vector3d end = carry(*arm.hand, hand_centre(side));
        bend(arm, side, end + 1.1 * hand_way, arm.fore->pivot + 1.4 * elbow_way);
    }
}

}  // namespace

void reach(PosedScene& scene, std::size_t first_part, const Holds& holds, const std::array<double, 2>& in_pocket) {
    for (std::size_t side = 0; side < 2; ++side) {
        const Arm arm = arm_of(scene, first_part, side);
        const Vector3d free = carry(*arm.hand, hand_centre(side));
        Vector3d target = free, inwards = Vector3d::Zero(), fingers = Vector3d::Zero();
        double weight = 0;
        for (const Hold& hold : holds[side]) {
            if (hold.weight <= 0) continue;
            target += hold.weight * (hold_point(scene, hold) - free);
            inwards += hold.weight * (scene.parts[hold.part].rotation * hold.inwards);
            fingers += hold.weight * (scene.parts[hold.part].rotation * hold.fingers);
            weight += hold.weight;
        }
        if (weight > 0) {
            bend(arm, side, target, arm.fore->pivot);
            turn_palm(arm, side, inwards, std::min(weight, 1.0));
            lay_palm(arm, inwards.normalized(), std::min(weight, 1.0));
            point_fingers(arm, side, inwards.normalized(), fingers, std::min(fingers.norm(), 1.0));
            bend(arm, side, target, arm.fore->pivot);
        }
        push_out(scene, first_part, side, obstacles_of(scene, first_part, side), in_pocket[side]);
    }
    // Once more, with both in place: the right arm gives way to the left one, which gives way to its upper arm.
    const PartSet right_upper_arm = part_bit(first_part + index_of(Part::right_upper_arm));
    push_out(scene, first_part, 0, obstacles_of(scene, first_part, 0) | right_upper_arm, in_pocket[0]);
    push_out(scene, first_part, 1, obstacles_of(scene, first_part, 1), in_pocket[1]);
}

}  // namespace htvm::synth
