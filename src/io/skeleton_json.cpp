#include "io/skeleton_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "core/orientation.h"
#include "io/skeleton_json_value.h"

namespace htvm {

using namespace internal;
namespace {

using nlohmann::json;

std::string frame_place(std::size_t frame) { return "frame " + std::to_string(frame) + " (the first is 0)"; }

std::string joint_place(std::size_t frame, std::size_t joint, const Skeleton& skeleton) {
    return frame_place(frame) + ", joint " + std::to_string(joint) + " \"" + skeleton.joint_names[joint] + "\"";
}

Result<double> millimetres_per_unit(const json& document, std::vector<std::string>& notes) {
    const json* units = find_member(document, "units");
    if (!units) {
        notes.push_back("The skeleton file does not say its units: taken as mm.");
        return 1.0;
    }
    if (*units == "mm") return 1.0;
    if (*units == "cm") return 10.0;
    if (*units == "m") return 1000.0;
    return fail(ErrorKind::bad_input, "units must be \"mm\", \"cm\" or \"m\"");
}

Result<Pose> pose_from_json(const json& frame, std::size_t t, const Skeleton& skeleton, double scale) {
    Pose pose;
    if (frame.is_null()) return pose;
    const std::size_t count = skeleton.joint_names.size();
    if (!frame.is_array() || frame.size() != count)
        return fail(ErrorKind::bad_input, frame_place(t) + ": must be null or a list of " + std::to_string(count) +
                                              " positions, one per joint" +
                                              (frame.is_array() ? ", has " + std::to_string(frame.size()) : ""));
    pose.joints.assign(count, Vector3d{});
    pose.found.assign(count, true);
    for (std::size_t j = 0; j < count; ++j) {
        const auto point = point_or_null(frame[j], scale);
        if (!point) return fail_at(joint_place(t, j, skeleton), point.error());
        pose.found[j] = point->has_value();
        if (*point) pose.joints[j] = **point;
    }
    return pose;
}

// Nine numbers, or three rows of three; null means unknown. Deviations beyond rounding are corrected; above 1e-3 they
// are an error.
Result<Rotation> rotation_from_json(const json& value) {
    if (value.is_null()) return unknown_orientation;
    const char* shape = "must be null or a 3x3 rotation matrix: three rows of three numbers";
    if (!value.is_array() || (value.size() != 3 && value.size() != 9)) return fail(ErrorKind::bad_input, shape);
    Rotation given;
    for (std::size_t i = 0; i < 9; ++i) {
        const json* number = value.size() == 9 ? &value[i] : nullptr;
        if (!number) {
            const json& row = value[i / 3];
            if (!row.is_array() || row.size() != 3) return fail(ErrorKind::bad_input, shape);
            number = &row[i % 3];
        }
        const auto element = finite_number(*number);
        if (!element) return fail(ErrorKind::bad_input, "element " + std::to_string(i) + " " + element.error().message);
        given[i] = *element;
    }
    const Rotation exact = orthonormalised(given);
    double worst = 0;
    for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::abs(exact[i] - given[i]));
    if (worst > 1e-3)
        return fail(ErrorKind::bad_input, "is not a rotation: its rows must be orthonormal and right-handed");
    return worst > 1e-12 ? exact : given;
}

Result<void> read_orientations(const json& list, SkeletonTrack& track) {
    const std::size_t bones = track.skeleton.bones.size();
    if (!list.is_array() || list.size() != track.poses.size())
        return fail(ErrorKind::bad_input, "orientations must have one entry for each of the " +
                                              std::to_string(track.poses.size()) + " frames");
    for (std::size_t t = 0; t < list.size(); ++t) {
        const json& frame = list[t];
        if (frame.is_null() || track.poses[t].joints.empty()) continue;
        if (!frame.is_array() || frame.size() != bones)
            return fail(ErrorKind::bad_input, "orientations, " + frame_place(t) +
                                                  ": must be null or one for each of the " + std::to_string(bones) +
                                                  " bones");
        auto& orientations = track.poses[t].orientations;
        for (std::size_t b = 0; b < bones; ++b) {
            const auto rotation = rotation_from_json(frame[b]);
            if (!rotation)
                return fail_at("orientations, " + frame_place(t) + ", bone " + std::to_string(b), rotation.error());
            orientations.push_back(*rotation);
        }
    }
    return {};
}

// Fills in timestamps and fps; either can be derived from the other.
Result<void> read_clock(const json& document, SkeletonTrack& track) {
    const json* fps = find_member(document, "fps");
    const json* timestamps = find_member(document, "timestamps");
    const std::size_t count = track.poses.size();
    if (fps) {
        const auto number = finite_number(*fps);
        if (!number || *number < 1e-3 || *number > 1e6)
            return fail(ErrorKind::bad_input, "fps must be a number from 0.001 to 1,000,000");
        track.fps = *number;
    }
    if (!timestamps) {
        track.rate_is_known = fps != nullptr;
        if (!fps)
            track.notes.push_back(
                "The skeleton file has neither fps nor timestamps: taken as 30 fps, or as the meshes.");
        for (std::size_t t = 0; t < count; ++t) track.timestamps.push_back(static_cast<double>(t) / track.fps);
        return {};
    }
    if (!timestamps->is_array() || timestamps->size() != count)
        return fail(ErrorKind::bad_input,
                    "timestamps must have one entry for each of the " + std::to_string(count) + " frames");
    for (const json& value : *timestamps) {
        const std::string place = "timestamps, " + frame_place(track.timestamps.size());
        const auto seconds = finite_number(value);
        if (!seconds) return fail_at(place, seconds.error());
        if (std::abs(*seconds) > 1e12) return fail(ErrorKind::bad_input, place + ": is not a time in seconds");
        if (!track.timestamps.empty() && *seconds <= track.timestamps.back())
            return fail(ErrorKind::bad_input, place + ": is not after the previous frame");
        track.timestamps.push_back(*seconds);
    }
    if (!fps && count >= 2) {
        const double span = track.timestamps.back() - track.timestamps.front();
        track.fps = std::min(1e6, std::max(1e-3, static_cast<double>(count - 1) / span));
    }
    return {};
}

Result<void> read_radii(const json& list, SkeletonTrack& track) {
    if (!list.is_array() || list.size() != track.skeleton.bones.size())
        return fail(ErrorKind::bad_input, "radii must have one entry for each of the " +
                                              std::to_string(track.skeleton.bones.size()) + " bones");
    for (const json& value : list) {
        const auto radius = finite_number(value);
        if (!radius || *radius < 0 || *radius > max_joint_coordinate)
            return fail(ErrorKind::bad_input, "the radius of bone " + std::to_string(track.radii.size()) +
                                                  " must be a number of mm, 0 or more");
        track.radii.push_back(*radius);
    }
    return {};
}

void append_number(std::string& out, double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value);  // the shortest text that reads back the same
    out.append(text, end.ptr);
}

template <std::size_t N>
void append_numbers(std::string& out, const std::array<double, N>& values, std::size_t begin, std::size_t end) {
    out += '[';
    for (std::size_t i = begin; i < end; ++i) {
        if (i > begin) out += ", ";
        append_number(out, values[i]);
    }
    out += ']';
}

bool all_finite(const auto& values) {
    for (const double value : values)
        if (!std::isfinite(value)) return false;
    return true;
}

Result<void> check_writable(const SkeletonTrack& track) {
    const std::size_t joints = track.skeleton.joint_names.size(), bones = track.skeleton.bones.size();
    if (track.timestamps.size() != track.poses.size())
        return fail(ErrorKind::bad_input, "The skeleton has " + std::to_string(track.poses.size()) + " poses but " +
                                              std::to_string(track.timestamps.size()) + " timestamps.");
    if (!all_finite(track.timestamps) || !all_finite(track.radii) || !(track.fps >= 1e-3 && track.fps <= 1e6))
        return fail(ErrorKind::bad_input,
                    "The skeleton has a timestamp or radius that is not finite, or an invalid rate.");
    if (!std::is_sorted(track.timestamps.begin(), track.timestamps.end(), std::less_equal<>()))
        return fail(ErrorKind::bad_input, "The skeleton's timestamps do not increase.");
    if (!track.radii.empty() && track.radii.size() != bones)
        return fail(ErrorKind::bad_input, "The skeleton has " + std::to_string(track.radii.size()) + " radii for " +
                                              std::to_string(bones) + " bones.");
    for (std::size_t t = 0; t < track.poses.size(); ++t) {
        const Pose& pose = track.poses[t];
        if (pose.joints.empty()) continue;
        if (pose.joints.size() != joints || (!pose.found.empty() && pose.found.size() != joints) ||
            (!pose.orientations.empty() && pose.orientations.size() != bones))
            return fail(ErrorKind::bad_input, "The pose of " + frame_place(t) + " does not fit the skeleton's " +
                                                  std::to_string(joints) + " joints and " + std::to_string(bones) +
                                                  " bones.");
        for (std::size_t j = 0; j < joints; ++j)
            if ((pose.found.empty() || pose.found[j]) && !all_finite(pose.joints[j]))
                return fail(ErrorKind::bad_input,
                            "The position at " + joint_place(t, j, track.skeleton) + " is not finite.");
        for (const Rotation& rotation : pose.orientations)
            if (!all_finite(rotation))
                return fail(ErrorKind::bad_input, "An orientation in " + frame_place(t) + " is not finite.");
    }
    return {};
}

void append_frames(std::string& out, const SkeletonTrack& track) {
    out += ",\n\"frames\": [";
    for (std::size_t t = 0; t < track.poses.size(); ++t) {
        const Pose& pose = track.poses[t];
        out += t > 0 ? ",\n" : "\n";
        out += pose.joints.empty() ? "null" : "[";
        for (std::size_t j = 0; j < pose.joints.size(); ++j) {
            if (j > 0) out += ", ";
            if (pose.found.empty() || pose.found[j])
                append_numbers(out, pose.joints[j], 0, 3);
            else
                out += "null";
        }
        if (!pose.joints.empty()) out += ']';
    }
    out += "\n]";
}

void append_orientations(std::string& out, const SkeletonTrack& track) {
    out += ",\n\"orientations\": [";
    for (std::size_t t = 0; t < track.poses.size(); ++t) {
        const Pose& pose = track.poses[t];
        const bool none = pose.joints.empty() || pose.orientations.empty();
        out += t > 0 ? ",\n" : "\n";
        out += none ? "null" : "[";
        for (std::size_t b = 0; !none && b < pose.orientations.size(); ++b) {
            if (b > 0) out += ", ";
            if (pose.orientations[b] == unknown_orientation) {
                out += "null";
                continue;
            }
            out += '[';
            for (std::size_t row = 0; row < 3; ++row) {
                if (row > 0) out += ", ";
                append_numbers(out, pose.orientations[b], 3 * row, 3 * row + 3);
            }
            out += ']';
        }
        if (!none) out += ']';
    }
    out += "\n]";
}

void append_list(std::string& out, const char* name, const std::vector<double>& values) {
    out += std::string(",\n\"") + name + "\": [";
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i > 0) out += ", ";
        append_number(out, values[i]);
    }
    out += ']';
}

}  // namespace

Result<SkeletonTrack> skeleton_from_json(const json& document) {
    SkeletonTrack track;
    const auto scale = millimetres_per_unit(document, track.notes);
    if (!scale) return tl::unexpected(scale.error());
    for (const char* name : {"joints", "bones", "frames"})
        if (!find_member(document, name))
            return fail(ErrorKind::bad_input, std::string("the skeleton file has no \"") + name + "\"");
    auto names = joint_names(*find_member(document, "joints"));
    if (!names) return fail_at("joints", names.error());
    track.skeleton.joint_names = std::move(*names);
    auto bones = bone_pairs(*find_member(document, "bones"), track.skeleton.joint_names);
    if (!bones) return fail_at("bones", bones.error());
    track.skeleton.bones = std::move(*bones);
    const json& frames = *find_member(document, "frames");
    if (!frames.is_array()) return fail(ErrorKind::bad_input, "frames must be a list");
    for (std::size_t t = 0; t < frames.size(); ++t) {
        auto pose = pose_from_json(frames[t], t, track.skeleton, *scale);
        if (!pose) return tl::unexpected(pose.error());
        track.poses.push_back(std::move(*pose));
    }
    if (const auto done = read_clock(document, track); !done) return tl::unexpected(done.error());
    if (const json* list = find_member(document, "orientations"))
        if (const auto done = read_orientations(*list, track); !done) return tl::unexpected(done.error());
    if (const json* list = find_member(document, "radii"))
        if (const auto done = read_radii(*list, track); !done) return tl::unexpected(done.error());
    return track;
}

Result<SkeletonTrack> parse_skeleton_json(std::string_view text) {
    const auto document = parse_json(text);
    if (!document) return tl::unexpected(document.error());
    return skeleton_from_json(*document);
}

Result<std::string> format_skeleton_json(const SkeletonTrack& track) {
    if (const auto checked = check_writable(track); !checked) return tl::unexpected(checked.error());
    const auto quoted = [](const std::string& name) {
        return json(name).dump(-1, ' ', false, json::error_handler_t::replace);  // tolerates bytes that are not UTF-8
    };
    std::string out = "{\n\"units\": \"mm\",\n\"fps\": ";
    append_number(out, track.fps);
    out += ",\n\"joints\": [";
    for (std::size_t j = 0; j < track.skeleton.joint_names.size(); ++j)
        out += (j > 0 ? ", " : "") + quoted(track.skeleton.joint_names[j]);
    out += "],\n\"bones\": [";
    for (std::size_t b = 0; b < track.skeleton.bones.size(); ++b) {
        const Bone& bone = track.skeleton.bones[b];
        out += (b > 0 ? ", [" : "[") + std::to_string(bone.first) + ", " + std::to_string(bone.second) + "]";
    }
    out += ']';
    bool regular = true, oriented = false;
    for (std::size_t t = 0; t < track.poses.size(); ++t) {
        regular = regular && track.timestamps[t] == static_cast<double>(t) / track.fps;
        oriented = oriented || !track.poses[t].orientations.empty();
    }
    if (!regular) append_list(out, "timestamps", track.timestamps);
    if (!track.radii.empty()) append_list(out, "radii", track.radii);
    append_frames(out, track);
    if (oriented) append_orientations(out, track);
    out += "\n}\n";
    return out;
}

}  // namespace htvm
