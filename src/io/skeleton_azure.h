// The JSON that Azure Kinect body tracking's offline processor writes: 32 joints in mm, in the depth camera's
// coordinates (x right, y down, z away), quaternions per joint, any number of bodies per frame.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "htvm/result.hpp"
#include "io/skeleton_track.h"

namespace htvm {

// Reads
//   {"joint_names": [32 names], "bone_list": [[name, name], ...],
//    "frames": [{"timestamp_usec": n, "frame_id": n, "num_bodies": n,
//                "bodies": [{"body_id": n, "joint_positions": [[x, y, z] x 32],
//                            "joint_orientations": [[w, x, y, z] x 32]}]}]}
// Names of members and of joints may be written in any case, with or without underscores; points and quaternions may be
// objects with x, y, z and w. One body is taken (choose_azure_body()); a frame without it, or null, is a missing frame.
// Without joint_names or bone_list: the sensor's own 32 joints and 31 bones, or the 26 without hands of its first
// versions. If bodies have fewer joints than are named, the first ones are taken. If the names are the sensor's, bones
// are turned to run away from the pelvis (the sensor's list runs from the chest down). Each bone is oriented like its
// first joint. Joints with coordinates that are null or NaN are not tracked. Time starts at the first frame; timestamps
// that are missing or not after the ones before are interpolated, with a note; fps is that of the median interval;
// without timestamps, 30 fps. Errors (bad_input, limit) name the frame and the joint.
Result<SkeletonTrack> parse_skeleton_azure(std::string_view text);

// The same from parsed JSON.
Result<SkeletonTrack> skeleton_from_azure(const nlohmann::json& document);

// Whether parsed JSON looks like the above: frames with bodies.
bool looks_like_azure(const nlohmann::json& document);

}  // namespace htvm
