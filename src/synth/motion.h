// How the synthetic person moves: a kinematic chain of rigid body parts, driven by joint angles that are smooth
// functions of time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace htvm::synth {

// The rigid parts of the body. Left and right alternate, so that `left_x + 1` is right_x.
enum class Part : std::uint8_t {
    pelvis,
    chest,
    neck,
    head,
    left_upper_arm,
    right_upper_arm,
    left_forearm,
    right_forearm,
    left_hand,
    right_hand,
    left_thigh,
    right_thigh,
    left_shin,
    right_shin,
    left_foot,
    right_foot,
};
inline constexpr std::size_t part_count = 16;
inline constexpr std::size_t joint_count = 15;

// The position of a part: rest coordinates q (mm, T-pose, y up, facing +z, the person's left at +x) lie at rotation *
// (q - rest_pivot) + pivot in the world.
struct PartFrame {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d rest_pivot = Eigen::Vector3d::Zero();
    Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
};

struct PosedBody {
    std::array<PartFrame, part_count> parts;
    std::array<Eigen::Vector3d, joint_count> joints;  // mm, in the order of synth_skeleton()
};

// The rest positions of the joints (mm), in the order of synth_skeleton().
const std::array<Eigen::Vector3d, joint_count>& rest_joints();

// The body at a time (s, >= 0): a T-pose that fades out during the first half second, then a cycle of 8 s of walking
// (1.2 m/s along a circle with a radius of 1 m), waving, turning and jumping. Depends on the time alone.
PosedBody pose_body(double seconds);

}  // namespace htvm::synth
