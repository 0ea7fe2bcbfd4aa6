// The skeleton of a mesh sequence: its bones, given once, and its pose in every frame.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace htvm {

using Vector3d = std::array<double, 3>;
using Rotation = std::array<double, 9>;  // 3x3 rotation matrix, row-major

// A bone b^i runs from joint j^(i,0) to joint j^(i,1) (paper, section IV-A).
struct Bone {
    std::uint16_t first = 0;   // index of j^(i,0), the joint that the bone turns about
    std::uint16_t second = 0;  // index of j^(i,1)
};

// What is constant over a sequence.
struct Skeleton {
    std::vector<std::string> joint_names;
    std::vector<Bone> bones;
};

// S_t: the skeleton in one frame.
struct Pose {
    std::vector<Vector3d> joints;  // mm, one per joint of the skeleton
    // One per joint; false: the tracker lost it, and its position is a guess, which is coded all the same. Empty: all
    // were found.
    std::vector<bool> found;
    std::vector<Rotation> orientations;  // T^i, one per bone; empty: derived from the joints
};

}  // namespace htvm
