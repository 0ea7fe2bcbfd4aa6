#include "io/skeleton_azure.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/skeleton_json_value.h"

namespace htvm {
namespace {

using nlohmann::json;

struct SensorJoint {
    const char* name;
    std::uint16_t parent;  // the pelvis is its own parent
};

// The sensor's joints in its order, each with its parent.
constexpr SensorJoint sensor_joints[] = {
    {"PELVIS", 0},        {"SPINE_NAVEL", 0},    {"SPINE_CHEST", 1},     {"NECK", 2},         {"CLAVICLE_LEFT", 2},
    {"SHOULDER_LEFT", 4}, {"ELBOW_LEFT", 5},     {"WRIST_LEFT", 6},      {"HAND_LEFT", 7},    {"HANDTIP_LEFT", 8},
    {"THUMB_LEFT", 7},    {"CLAVICLE_RIGHT", 2}, {"SHOULDER_RIGHT", 11}, {"ELBOW_RIGHT", 12}, {"WRIST_RIGHT", 13},
    {"HAND_RIGHT", 14},   {"HANDTIP_RIGHT", 15}, {"THUMB_RIGHT", 14},    {"HIP_LEFT", 0},     {"KNEE_LEFT", 18},
    {"ANKLE_LEFT", 19},   {"FOOT_LEFT", 20},     {"HIP_RIGHT", 0},       {"KNEE_RIGHT", 22},  {"ANKLE_RIGHT", 23},
    {"FOOT_RIGHT", 24},   {"HEAD", 3},           {"NOSE", 26},           {"EYE_LEFT", 27},    {"EAR_LEFT", 28},
    {"EYE_RIGHT", 27},    {"EAR_RIGHT", 30},
};

std::string frame_place(std::size_t frame) { return "frame " + std::to_string(frame) + " (the first is 0)"; }

// The name of the parent of a sensor joint; nullptr for names that the sensor does not have.
const char* sensor_parent(const std::string& name) {
    for (const auto& joint : sensor_joints)
        if (name == joint.name) return sensor_joints[joint.parent].name;
    return nullptr;
}

Result<Skeleton> read_hierarchy(const json& document, std::vector<std::string>& notes) {
    Skeleton skeleton;
    if (const json* names = find_member(document, "joint_names")) {
        auto read = joint_names(*names);
        if (!read) return fail_at("joint_names", read.error());
        skeleton.joint_names = std::move(*read);
    } else {
        for (const auto& joint : sensor_joints) skeleton.joint_names.emplace_back(joint.name);
        notes.push_back("The file names no joints: taken as the sensor's 32.");
    }
    if (const json* bones = find_member(document, "bone_list")) {
        auto read = bone_pairs(*bones, skeleton.joint_names);
        if (!read) return fail_at("bone_list", read.error());
        skeleton.bones = std::move(*read);
        // A bone turns about its first joint, so that must be the end nearer to the pelvis.
        for (Bone& bone : skeleton.bones) {
            const char* parent = sensor_parent(skeleton.joint_names[bone.first]);
            if (parent && skeleton.joint_names[bone.second] == parent) std::swap(bone.first, bone.second);
        }
        return skeleton;
    }
    for (std::size_t j = 0; j < skeleton.joint_names.size(); ++j) {
        const char* parent = sensor_parent(skeleton.joint_names[j]);
        if (!parent || skeleton.joint_names[j] == parent) continue;
        const auto found = std::find(skeleton.joint_names.begin(), skeleton.joint_names.end(), parent);
        if (found != skeleton.joint_names.end())
            skeleton.bones.push_back(
                {static_cast<std::uint16_t>(found - skeleton.joint_names.begin()), static_cast<std::uint16_t>(j)});
    }
    if (skeleton.bones.empty())
        return fail(ErrorKind::bad_input, "the file has no bone_list, and its joint_names are not the sensor's");
    notes.push_back("The file lists no bones: taken as the sensor's.");
    return skeleton;
}

// Bodies without an id are identified by their index in the frame.
std::int64_t body_id(const json& body, std::size_t place) {
    const json* id = find_member(body, "body_id");
    return id && id->is_number_integer() ? id->get<std::int64_t>() : -1 - static_cast<std::int64_t>(place);
}

Result<const json*> bodies_of(const json& frame, std::size_t t) {
    if (!frame.is_object()) return fail(ErrorKind::bad_input, frame_place(t) + ": is not an object");
    const json* bodies = find_member(frame, "bodies");
    if (bodies && !bodies->is_array()) return fail(ErrorKind::bad_input, frame_place(t) + ": bodies must be a list");
    return bodies;
}

// The id of the body seen in most frames; of equals, the one seen first; 0 if there is no body.
Result<std::int64_t> choose_body(const json& frames, std::vector<std::string>& notes) {
    struct Seen {
        std::size_t frames = 0, order = 0, last_frame = 0;
    };
    std::map<std::int64_t, Seen> seen;
    for (std::size_t t = 0; t < frames.size(); ++t) {
        const auto bodies = bodies_of(frames[t], t);
        if (!bodies) return tl::unexpected(bodies.error());
        for (std::size_t i = 0; *bodies && i < (*bodies)->size(); ++i) {
            const std::int64_t id = body_id((**bodies)[i], i);
            auto [entry, added] = seen.try_emplace(id, Seen{0, seen.size(), 0});
            if (!added && entry->second.last_frame == t) continue;  // listed twice in one frame
            entry->second.last_frame = t;
            ++entry->second.frames;
        }
    }
    const auto better = [](const auto& a, const auto& b) {
        return a.second.frames != b.second.frames ? a.second.frames < b.second.frames : a.second.order > b.second.order;
    };
    const auto best = std::max_element(seen.begin(), seen.end(), better);
    if (best == seen.end()) return 0;
    if (seen.size() > 1)
        notes.push_back("The file tracks " + std::to_string(seen.size()) + " bodies: body " +
                        std::to_string(best->first) + " is taken, seen in most frames (" +
                        std::to_string(best->second.frames) + " of " + std::to_string(frames.size()) + ").");
    return best->first;
}

// The rotation of a unit quaternion; null and the zero quaternion mean unknown.
Result<Rotation> rotation_from_quaternion(const json& value) {
    if (value.is_null()) return unknown_orientation;
    if (!value.is_array() || value.size() != 4) return fail(ErrorKind::bad_input, "must be [w, x, y, z]");
    std::array<double, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) {
        const auto number = finite_number(value[i]);
        if (!number) return fail(ErrorKind::bad_input, "element " + std::to_string(i) + " " + number.error().message);
        q[i] = *number;
    }
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (size < 1e-9) return unknown_orientation;
    if (std::abs(size - 1) > 0.01) return fail(ErrorKind::bad_input, "is not a unit quaternion");
    const double w = q[0] / size, x = q[1] / size, y = q[2] / size, z = q[3] / size;
    return Rotation{1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                    2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                    2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

Result<Pose> read_body(const json& body, std::size_t t, const Skeleton& skeleton) {
    const std::size_t count = skeleton.joint_names.size();
    const auto place = [&](const char* list, std::size_t j) {
        return frame_place(t) + ", " + list + " " + std::to_string(j) + " \"" + skeleton.joint_names[j] + "\"";
    };
    Pose pose;
    const json* positions = find_member(body, "joint_positions");
    if (!positions || !positions->is_array() || positions->size() != count)
        return fail(ErrorKind::bad_input, frame_place(t) + ": joint_positions must have one entry for each of the " +
                                              std::to_string(count) + " joints");
    for (std::size_t j = 0; j < count; ++j) {
        const auto point = point_or_null((*positions)[j], 1);
        if (!point) return fail_at(place("joint", j), point.error());
        pose.found.push_back(point->has_value());
        pose.joints.push_back(point->value_or(Vector3d{}));
    }
    const json* orientations = find_member(body, "joint_orientations");
    if (!orientations) return pose;
    if (!orientations->is_array() || orientations->size() != count)
        return fail(ErrorKind::bad_input, frame_place(t) + ": joint_orientations must have one entry for each of the " +
                                              std::to_string(count) + " joints");
    std::vector<Rotation> by_joint;
    for (std::size_t j = 0; j < count; ++j) {
        const auto rotation = rotation_from_quaternion((*orientations)[j]);
        if (!rotation) return fail_at(place("orientation of joint", j), rotation.error());
        by_joint.push_back(*rotation);
    }
    for (const Bone& bone : skeleton.bones) pose.orientations.push_back(by_joint[bone.first]);
    return pose;
}

Result<void> read_clock(const json& frames, SkeletonTrack& track) {
    std::vector<double> seconds;
    for (std::size_t t = 0; t < frames.size(); ++t) {
        const json* stamp = find_member(frames[t], "timestamp_usec");
        if (!stamp) break;
        const auto number = finite_number(*stamp);
        if (!number || std::abs(*number) > 1e18)
            return fail(ErrorKind::bad_input, frame_place(t) + ": timestamp_usec must be a number of microseconds");
        seconds.push_back(*number / 1e6);
    }
    track.timestamps.clear();
    if (seconds.size() < frames.size()) {
        track.notes.push_back("The file lacks timestamps: taken as 30 fps.");
        for (std::size_t t = 0; t < frames.size(); ++t) track.timestamps.push_back(static_cast<double>(t) / track.fps);
        return {};
    }
    std::vector<double> intervals;
    for (std::size_t t = 0; t < seconds.size(); ++t) {
        track.timestamps.push_back(seconds[t] - seconds[0]);
        if (t == 0) continue;
        intervals.push_back(track.timestamps[t] - track.timestamps[t - 1]);
        if (!(intervals.back() > 0))
            return fail(ErrorKind::bad_input,
                        frame_place(t) + ": its timestamp is not after that of the previous frame");
    }
    if (intervals.empty()) return {};
    const auto median = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
    std::nth_element(intervals.begin(), median, intervals.end());
    track.fps = std::clamp(1 / *median, 1e-3, 1e6);
    return {};
}

}  // namespace

bool looks_like_azure(const json& document) {
    if (find_member(document, "bone_list") || find_member(document, "joint_names")) return true;
    const json* frames = find_member(document, "frames");
    return frames && frames->is_array() && !frames->empty() && find_member(frames->front(), "bodies");
}

Result<SkeletonTrack> skeleton_from_azure(const json& document) {
    SkeletonTrack track;
    auto skeleton = read_hierarchy(document, track.notes);
    if (!skeleton) return tl::unexpected(skeleton.error());
    track.skeleton = std::move(*skeleton);
    const json* frames = find_member(document, "frames");
    if (!frames || !frames->is_array()) return fail(ErrorKind::bad_input, "the file has no list of frames");
    const auto chosen = choose_body(*frames, track.notes);
    if (!chosen) return tl::unexpected(chosen.error());
    for (std::size_t t = 0; t < frames->size(); ++t) {
        Pose pose;
        const auto bodies = bodies_of((*frames)[t], t);
        for (std::size_t i = 0; *bodies && i < (*bodies)->size(); ++i) {
            if (body_id((**bodies)[i], i) != *chosen) continue;
            auto read = read_body((**bodies)[i], t, track.skeleton);
            if (!read) return tl::unexpected(read.error());
            pose = std::move(*read);
            break;
        }
        track.poses.push_back(std::move(pose));
    }
    if (const auto clock = read_clock(*frames, track); !clock) return tl::unexpected(clock.error());
    return track;
}

Result<SkeletonTrack> parse_skeleton_azure(std::string_view text) {
    const auto document = parse_json(text);
    if (!document) return tl::unexpected(document.error());
    return skeleton_from_azure(*document);
}

}  // namespace htvm
