#include "io/skeleton_azure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/skeleton_azure_body.h"
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

// The joints of the first versions of the sensor's library, which had no hands.
constexpr std::size_t joints_without_hands = 26;
bool is_of_hand(std::string_view name) {
    return name.starts_with("HAND_") || name.starts_with("HANDTIP_") || name.starts_with("THUMB_");
}

std::string frame_place(std::size_t frame) { return "frame " + std::to_string(frame) + " (the first is 0)"; }

// A name as the sensor's are written: "K4ABT_JOINT_SPINE_NAVAL" and "SpineNavel" are "SPINENAVEL".
std::string plain_name(std::string_view name) {
    constexpr std::string_view prefix = "K4ABTJOINT";
    std::string out;
    for (const char c : name) {
        if (c >= 'a' && c <= 'z') out += static_cast<char>(c - 'a' + 'A');
        if ((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) out += c;
    }
    if (out.starts_with(prefix)) out.erase(0, prefix.size());
    if (out == "SPINENAVAL") out = "SPINENAVEL";
    return out;
}

// The joint of the sensor of that name; nullptr for names that the sensor does not have.
const SensorJoint* sensor_joint(std::string_view name) {
    const auto plain = plain_name(name);
    for (const auto& joint : sensor_joints)
        if (plain == plain_name(joint.name)) return &joint;
    return nullptr;
}

// The joint that is the parent of one of the sensor's; nothing if there is none.
std::optional<std::size_t> parent_of(const std::vector<std::string>& names, std::size_t joint) {
    const auto* sensor = sensor_joint(names[joint]);
    if (!sensor || sensor == &sensor_joints[0]) return std::nullopt;
    const auto parent = plain_name(sensor_joints[sensor->parent].name);
    for (std::size_t j = 0; j < names.size(); ++j)
        if (plain_name(names[j]) == parent) return j;
    return std::nullopt;
}

const json* positions_of(const json& body) { return find_member(body, "joint_positions"); }

// How many joints the first body has; 0 if there is no body.
std::size_t count_joints(const json& frames) {
    for (const json& frame : frames) {
        const json* bodies = find_member(frame, "bodies");
        if (!bodies || !bodies->is_array()) continue;
        for (const json& body : *bodies)
            if (const json* positions = positions_of(body); positions && positions->is_array())
                return positions->size();
    }
    return 0;
}

// The names in the file, as many as the bodies have joints.
Result<std::vector<std::string>> names_of_joints(const json& document, std::size_t count,
                                                 std::vector<std::string>& notes) {
    std::vector<std::string> out;
    if (const json* names = find_member(document, "joint_names")) {
        auto read = joint_names(*names);
        if (!read) return fail_at("joint_names", read.error());
        out = std::move(*read);
        if (count > 0 && count < out.size()) {
            notes.push_back("The file names " + std::to_string(out.size()) + " joints, but its bodies have " +
                            std::to_string(count) + ": the first ones are taken.");
            out.resize(count);
        }
        return out;
    }
    const bool no_hands = count == joints_without_hands;
    for (const auto& joint : sensor_joints)
        if (!(no_hands && is_of_hand(joint.name)) && (count == 0 || out.size() < count)) out.emplace_back(joint.name);
    notes.push_back("The file names no joints: taken as the sensor's " + std::to_string(out.size()) +
                    (no_hands ? " without hands." : "."));
    return out;
}

// Without bones of joints that the bodies do not have, which are those behind the first `count`.
json bones_among(const json& list, const std::vector<std::string>& names) {
    if (!list.is_array()) return list;
    json out = json::array();
    for (const json& bone : list) {
        bool is_known = true;
        if (bone.is_array())
            for (const json& end : bone)
                is_known = is_known && (end.is_string() ? std::find(names.begin(), names.end(), end) != names.end()
                                                        : !end.is_number_unsigned() || end < names.size());
        if (is_known) out.push_back(bone);
    }
    return out;
}

Result<Skeleton> read_hierarchy(const json& document, std::size_t count, std::vector<std::string>& notes) {
    Skeleton skeleton;
    const std::size_t noted = notes.size();
    auto names = names_of_joints(document, count, notes);
    if (!names) return tl::unexpected(names.error());
    skeleton.joint_names = std::move(*names);
    const bool are_fewer = notes.size() > noted && find_member(document, "joint_names");
    if (const json* bones = find_member(document, "bone_list")) {
        auto read = bone_pairs(are_fewer ? bones_among(*bones, skeleton.joint_names) : *bones, skeleton.joint_names);
        if (!read) return fail_at("bone_list", read.error());
        skeleton.bones = std::move(*read);
        // A bone turns about its first joint, so that must be the end nearer to the pelvis.
        for (Bone& bone : skeleton.bones)
            if (parent_of(skeleton.joint_names, bone.first) == bone.second) std::swap(bone.first, bone.second);
        return skeleton;
    }
    for (std::size_t j = 0; j < skeleton.joint_names.size(); ++j)
        if (const auto parent = parent_of(skeleton.joint_names, j))
            skeleton.bones.push_back({static_cast<std::uint16_t>(*parent), static_cast<std::uint16_t>(j)});
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

// Where a body is: its first joint that is tracked.
std::optional<Vector3d> place_of(const json& body) {
    const json* positions = positions_of(body);
    if (!positions || !positions->is_array()) return std::nullopt;
    for (const json& position : *positions)
        if (const auto point = point_or_null(position, 1); point && *point) return **point;
    return std::nullopt;
}

// The bodies of a frame; null of one that is null or has none.
Result<const json*> bodies_of(const json& frame, std::size_t t) {
    if (frame.is_null()) return nullptr;
    if (!frame.is_object()) return fail(ErrorKind::bad_input, frame_place(t) + ": is not an object");
    const json* bodies = find_member(frame, "bodies");
    if (bodies && !bodies->is_array()) return fail(ErrorKind::bad_input, frame_place(t) + ": bodies must be a list");
    return bodies;
}

// The rotation of a unit quaternion; null and the zero quaternion mean unknown.
Result<Rotation> rotation_from_quaternion(const json& value) {
    constexpr std::array names = {"w", "x", "y", "z"};
    if (value.is_null()) return unknown_orientation;
    if (!value.is_object() && (!value.is_array() || value.size() != names.size()))
        return fail(ErrorKind::bad_input, "must be [w, x, y, z]");
    std::array<double, 4> q{};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const json* element = value.is_object() ? find_member(value, names[i]) : &value[i];
        if (!element || element->is_null()) return unknown_orientation;
        const auto number = finite_number(*element);
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
    const json* positions = positions_of(body);
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

// Microseconds at which a frame was taken, as it says; nothing if it does not.
std::optional<double> stamp_of(const json& frame) {
    for (const char* name : {"timestamp_usec", "timestamp_us", "device_timestamp_usec"})
        if (const json* stamp = find_member(frame, name))
            if (const auto number = finite_number(*stamp); number && std::abs(*number) <= 1e18) return *number;
    return std::nullopt;
}

// Which of the numbers are the most that ascend: the others are out of order. Those without a number are not.
std::vector<bool> ascending(const std::vector<std::optional<double>>& numbers) {
    constexpr auto none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> ends, before(numbers.size(), none);  // ends[n]: place of the lowest end of n + 1 numbers
    for (std::size_t t = 0; t < numbers.size(); ++t) {
        if (!numbers[t]) continue;
        const auto at = std::lower_bound(ends.begin(), ends.end(), *numbers[t],
                                         [&](std::size_t end, double number) { return *numbers[end] < number; });
        if (at != ends.end() && *numbers[*at] == *numbers[t]) continue;
        if (at != ends.begin()) before[t] = *(at - 1);
        if (at == ends.end())
            ends.push_back(t);
        else
            *at = t;
    }
    std::vector<bool> out(numbers.size());
    for (std::size_t t = ends.empty() ? none : ends.back(); t != none; t = before[t]) out[t] = true;
    return out;
}

double median_of(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Seconds from the first frame on, where some frames say when they were taken (as `known` says): between these by the
// frames' number, beyond them at the median interval of one frame.
std::vector<double> seconds_of(const std::vector<std::optional<double>>& stamps, const std::vector<bool>& known,
                               double interval) {
    std::vector<double> out(stamps.size());
    std::optional<std::size_t> last;
    for (std::size_t t = 0; t < stamps.size(); ++t) {
        if (!known[t]) continue;
        out[t] = *stamps[t] / 1e6;
        const std::size_t from = last ? *last + 1 : 0;
        for (std::size_t k = from; k < t; ++k) {
            const auto behind = static_cast<double>(t - k);
            out[k] = last ? out[t] - (out[t] - out[*last]) * behind / static_cast<double>(t - *last)
                          : out[t] - interval * behind;
        }
        last = t;
    }
    for (std::size_t k = *last + 1; k < out.size(); ++k)
        out[k] = out[*last] + interval * static_cast<double>(k - *last);
    const double start = out[0];
    for (double& seconds : out) seconds -= start;
    return out;
}

// Frames that do not say when they were taken are counted.
void number_frames(const json& frames, SkeletonTrack& track) {
    track.notes.push_back("The file lacks timestamps: taken as 30 fps, or as the meshes.");
    track.rate_is_known = false;
    track.timestamps.clear();
    for (std::size_t t = 0; t < frames.size(); ++t) track.timestamps.push_back(static_cast<double>(t) / track.fps);
}

void read_clock(const json& frames, SkeletonTrack& track) {
    std::vector<std::optional<double>> stamps;
    for (const json& frame : frames) stamps.push_back(stamp_of(frame));
    const auto known = ascending(stamps);
    const auto count = static_cast<std::size_t>(std::count(known.begin(), known.end(), true));
    if (count == 0 || (count == 1 && frames.size() > 1)) return number_frames(frames, track);
    std::vector<double> intervals;
    std::optional<std::size_t> last;
    for (std::size_t t = 0; t < stamps.size(); ++t) {
        if (!known[t]) continue;
        if (last) intervals.push_back((*stamps[t] - *stamps[*last]) / 1e6 / static_cast<double>(t - *last));
        last = t;
    }
    const double interval = intervals.empty() ? 1 / track.fps : median_of(intervals);
    track.timestamps = seconds_of(stamps, known, interval);
    for (std::size_t t = 1; t < track.timestamps.size(); ++t)
        if (!(track.timestamps[t] > track.timestamps[t - 1])) return number_frames(frames, track);
    if (count < frames.size())
        track.notes.push_back("In " + std::to_string(frames.size() - count) + " of " + std::to_string(frames.size()) +
                              " frames of the file the timestamp is missing or not after the one before: theirs are " +
                              "interpolated.");
    if (frames.size() > 1) track.fps = std::clamp(1 / interval, 1e-3, 1e6);
}

}  // namespace

bool looks_like_azure(const json& document) {
    if (find_member(document, "bone_list") || find_member(document, "joint_names")) return true;
    const json* frames = find_member(document, "frames");
    if (!frames || !frames->is_array()) return false;
    return std::any_of(frames->begin(), frames->end(), [](const json& f) { return find_member(f, "bodies"); });
}

Result<SkeletonTrack> skeleton_from_azure(const json& document) {
    SkeletonTrack track;
    const json* frames = find_member(document, "frames");
    if (!frames || !frames->is_array()) return fail(ErrorKind::bad_input, "the file has no list of frames");
    auto skeleton = read_hierarchy(document, count_joints(*frames), track.notes);
    if (!skeleton) return tl::unexpected(skeleton.error());
    track.skeleton = std::move(*skeleton);
    std::vector<AzureBodies> bodies;
    for (std::size_t t = 0; t < frames->size(); ++t) {
        const auto list = bodies_of((*frames)[t], t);
        if (!list) return tl::unexpected(list.error());
        auto& here = bodies.emplace_back();
        for (std::size_t i = 0; *list && i < (*list)->size(); ++i) {
            const json& body = (**list)[i];
            here.push_back({body_id(body, i), place_of(body)});
        }
    }
    const auto chosen = choose_azure_body(bodies, track.notes);
    for (std::size_t t = 0; t < frames->size(); ++t) {
        track.poses.emplace_back();
        if (!chosen[t]) continue;
        auto read = read_body((**bodies_of((*frames)[t], t))[*chosen[t]], t, track.skeleton);
        if (!read) return tl::unexpected(read.error());
        track.poses.back() = std::move(*read);
    }
    read_clock(*frames, track);
    return track;
}

Result<SkeletonTrack> parse_skeleton_azure(std::string_view text) {
    const auto document = parse_json(text);
    if (!document) return tl::unexpected(document.error());
    return skeleton_from_azure(*document);
}

}  // namespace htvm
