// What must hold for every skeleton track that an importer returns.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "fuzz_input.h"
#include "io/skeleton_align.h"
#include "io/skeleton_json.h"
#include "io/skeleton_track.h"

namespace htvm::fuzz {

inline void require_sound(const SkeletonTrack& track) {
    const std::size_t joints = track.skeleton.joint_names.size(), bones = track.skeleton.bones.size();
    require(joints <= max_skeleton_joints && bones <= max_skeleton_bones, "no more joints and bones than allowed");
    for (const auto& bone : track.skeleton.bones)
        require(bone.first < joints && bone.second < joints, "bones of joints");
    require(track.timestamps.size() == track.poses.size(), "one timestamp a pose");
    for (std::size_t i = 1; i < track.timestamps.size(); ++i)
        require(track.timestamps[i] > track.timestamps[i - 1], "time goes on");
    require(std::isfinite(track.fps) && track.fps > 0, "a frame rate");
    require(track.radii.empty() || track.radii.size() == bones, "one radius a bone, or none");
    for (const auto& pose : track.poses) {
        if (pose.joints.empty()) continue;
        require(pose.joints.size() == joints && (pose.found.empty() || pose.found.size() == joints), "all joints");
        require(pose.orientations.empty() || pose.orientations.size() == bones, "all bones, or none");
        for (const auto& joint : pose.joints)
            for (const double c : joint) require(std::isfinite(c), "positions are finite");
    }
}

inline void check_track(const Result<SkeletonTrack>& track) {
    if (!track) return require(!track.error().message.empty(), "an error says what is wrong");
    require_sound(*track);
    const auto text = format_skeleton_json(*track);
    require(text.has_value(), "a track can be written");
    const auto again = parse_skeleton_json(*text);
    require(again && again->poses.size() == track->poses.size(), "a written track can be read");
    const auto text_again = format_skeleton_json(*again);
    require(text_again && *text_again == *text, "what was written reads back");
    MeshClock clock;
    clock.frames = std::min<std::size_t>(track->poses.size(), 64);
    (void)align(*track, clock);
}

}  // namespace htvm::fuzz
