#include "io/skeleton_bvh.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/orientation.h"
#include "io/skeleton_bvh_text.h"

namespace htvm {

using namespace internal;
namespace {

Rotation axis_rotation(std::size_t axis, double degrees) {
    const double angle = std::fmod(degrees, 360.0) * std::numbers::pi / 180;
    const double c = std::cos(angle), s = std::sin(angle);
    if (axis == 0) return {1, 0, 0, 0, c, -s, 0, s, c};
    if (axis == 1) return {c, 0, s, 0, 1, 0, -s, 0, c};
    return {c, -s, 0, s, c, 0, 0, 0, 1};
}

double distance(const Vector3d& a, const Vector3d& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// The translation given by a joint's position channels; zero on axes without a channel.
Vector3d channel_position(const BvhJoint& joint, const double* values) {
    Vector3d position{};
    for (std::size_t c = 0; c < joint.channels.size(); ++c)
        if (!joint.channels[c].rotation) position[joint.channels[c].axis] = values[c];
    return position;
}

// Exporters disagree on whether position channels replace OFFSET or are added to it; the first frame tells which.
void settle_position_channels(BvhHierarchy& hierarchy, const std::vector<double>& frame,
                              std::vector<std::string>& notes) {
    struct Joints {
        std::size_t count = 0;
        std::string first;
    };
    std::array<Joints, 2> settled;
    std::size_t next = 0;
    for (auto& joint : hierarchy.joints) {
        const Vector3d position = channel_position(joint, frame.data() + next);
        next += joint.channels.size();
        const bool has_position =
            std::any_of(joint.channels.begin(), joint.channels.end(), [](BvhChannel c) { return !c.rotation; });
        if (!has_position || joint.offset == Vector3d{}) continue;
        joint.channels_repeat_offset = distance(position, joint.offset) < distance(position, {});
        auto& [count, first] = settled[joint.channels_repeat_offset ? 0 : 1];
        if (count++ == 0) first = joint.name;
    }
    for (const bool repeats : {true, false}) {
        const auto& [count, first] = settled[repeats ? 0 : 1];
        if (count == 0) continue;
        notes.push_back("BVH joint \"" + first + "\"" +
                        (count > 1 ? " and " + std::to_string(count - 1) + " more" : std::string()) +
                        ": position channels taken " + (repeats ? "in place of" : "on top of") + " its OFFSET.");
    }
}

struct GlobalPose {
    std::vector<Vector3d> positions;  // file units
    std::vector<Rotation> rotations;
};

// Forward kinematics; without values: the rest pose.
GlobalPose forward_kinematics(const BvhHierarchy& hierarchy, const std::vector<double>* values) {
    GlobalPose pose;
    std::size_t next = 0;
    for (const auto& joint : hierarchy.joints) {
        Vector3d local = joint.offset;
        Rotation rotation = identity_rotation;
        if (values) {
            for (std::size_t c = 0; c < joint.channels.size(); ++c, ++next) {
                const auto [axis, rotates] = joint.channels[c];
                const double value = (*values)[next];
                if (rotates)
                    rotation = multiply(rotation, axis_rotation(axis, value));
                else
                    local[axis] = value + (joint.channels_repeat_offset ? 0 : joint.offset[axis]);
            }
        }
        if (joint.parent == no_bvh_parent) {
            pose.positions.push_back(local);
            pose.rotations.push_back(rotation);
            continue;
        }
        const Rotation& parent = pose.rotations[joint.parent];
        const Vector3d turned = rotate(parent, local);
        const Vector3d& from = pose.positions[joint.parent];
        pose.positions.push_back({from[0] + turned[0], from[1] + turned[1], from[2] + turned[2]});
        pose.rotations.push_back(multiply(parent, rotation));
    }
    return pose;
}

double largest_extent(const GlobalPose& pose) {
    double extent = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto by_axis = [&](const Vector3d& a, const Vector3d& b) { return a[axis] < b[axis]; };
        const auto [low, high] = std::minmax_element(pose.positions.begin(), pose.positions.end(), by_axis);
        extent = std::max(extent, (*high)[axis] - (*low)[axis]);
    }
    return extent;
}

struct GuessedUnit {
    const char* name;
    double mm;
};

// A figure of few joints may be an arm; one of many is a person, whom centimetres and metres can make a doll or a
// giant.
GuessedUnit unit_of(double height, std::size_t joints) {
    constexpr std::size_t joints_of_person = 15;
    const bool is_person = joints >= joints_of_person;
    if (is_person && height >= 4 && height < 8) return {"feet", 304.8};
    if (height < 10) return {"metres", 1000};
    if (is_person && height >= 48 && height < 90) return {"inches", 25.4};
    return height < 600 ? GuessedUnit{"centimetres", 10} : GuessedUnit{"millimetres", 1};
}

double guess_unit(double height, std::size_t joints, std::vector<std::string>& notes) {
    const auto [name, mm] = unit_of(height, joints);
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, height, std::chars_format::general, 4);
    notes.push_back("BVH has no units: its skeleton is " + std::string(text, end.ptr) + " units tall, taken as " +
                    name + ".");
    return mm;
}

Result<Pose> pose_in_mm(const BvhHierarchy& hierarchy, const GlobalPose& global, double scale, std::size_t frame) {
    Pose pose;
    pose.found.assign(hierarchy.joints.size(), true);
    for (std::size_t j = 0; j < hierarchy.joints.size(); ++j) {
        Vector3d mm = global.positions[j];
        for (double& coordinate : mm) {
            coordinate *= scale;
            if (!(std::abs(coordinate) <= max_joint_coordinate))
                return fail(ErrorKind::bad_input, "BVH frame " + std::to_string(frame) + " (the first is 0), joint \"" +
                                                      hierarchy.joints[j].name +
                                                      "\": lies more than 1000 km from the origin; check the units");
        }
        pose.joints.push_back(mm);
        if (hierarchy.joints[j].parent != no_bvh_parent)
            pose.orientations.push_back(global.rotations[hierarchy.joints[j].parent]);
    }
    return pose;
}

}  // namespace

Result<SkeletonTrack> parse_skeleton_bvh(std::string_view text, const BvhOptions& options) {
    if (!(options.mm_per_unit >= 0) || options.mm_per_unit > 1e6)
        return fail(ErrorKind::bad_input, "the unit of a BVH file must be 0 (guessed) or a positive number of mm");
    auto bvh = read_bvh_text(text);
    if (!bvh) return tl::unexpected(bvh.error());
    auto& [hierarchy, frames, frame_time, notes] = *bvh;
    SkeletonTrack track;
    track.notes = std::move(notes);
    track.rate_is_known = frame_time > 0;
    if (track.rate_is_known) track.fps = 1 / frame_time;
    for (std::size_t j = 0; j < hierarchy.joints.size(); ++j) {
        const auto& joint = hierarchy.joints[j];
        track.skeleton.joint_names.push_back(joint.name);
        if (joint.parent != no_bvh_parent)
            track.skeleton.bones.push_back({static_cast<std::uint16_t>(joint.parent), static_cast<std::uint16_t>(j)});
    }
    const auto first = std::find_if(frames.begin(), frames.end(), [](const auto& f) { return !f.values.empty(); });
    settle_position_channels(hierarchy, first->values, track.notes);
    double scale = options.mm_per_unit;
    if (scale == 0) {
        const double rest = largest_extent(forward_kinematics(hierarchy, nullptr));
        const double moved = largest_extent(forward_kinematics(hierarchy, &first->values));
        scale = guess_unit(std::max(rest, moved), hierarchy.joints.size(), track.notes);
    }
    for (std::size_t t = 0; t < frames.size(); ++t) {
        track.timestamps.push_back(static_cast<double>(t) * (frame_time > 0 ? frame_time : 1 / track.fps));
        if (frames[t].values.empty()) {
            track.poses.emplace_back();
            continue;
        }
        auto pose = pose_in_mm(hierarchy, forward_kinematics(hierarchy, &frames[t].values), scale, t);
        if (!pose) return tl::unexpected(pose.error());
        track.poses.push_back(std::move(*pose));
        frames[t].values = {};
    }
    return track;
}

}  // namespace htvm
