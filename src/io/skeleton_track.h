// A skeleton's motion as read from a file, on the tracker's own clock, before it is aligned with the mesh frames.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "htvm/skeleton.hpp"

namespace htvm {

// Limits for all skeleton readers, so that a file of n bytes never takes more than a small multiple of n.
inline constexpr std::size_t max_skeleton_joints = 1024;
inline constexpr std::size_t max_skeleton_bones = 1024;
inline constexpr double max_joint_coordinate = 1e9;  // mm

// Used in Pose::orientations for a bone whose orientation the file does not give in that frame. align() replaces it.
inline constexpr Rotation unknown_orientation = {};

struct SkeletonTrack {
    Skeleton skeleton;
    // One per frame. A missing frame has an empty pose (no joints); otherwise joints and tracked are one per joint, and
    // orientations is empty or one per bone, unknown_orientation if not given. A joint that is not tracked is 0, 0, 0.
    std::vector<Pose> poses;
    std::vector<double> timestamps;  // seconds, one per pose, strictly increasing
    double fps = 30;                 // poses per second, > 0
    bool rate_is_known = true;       // false: fps is assumed, and timestamps are frame / fps
    std::vector<double> radii;       // mm, one per bone; empty: not calibrated
    std::vector<std::string> notes;  // what was assumed or corrected while reading, one sentence each, for the user
};

}  // namespace htvm
