#include "io/skeleton_bvh.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/orientation.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::size_t no_parent = static_cast<std::size_t>(-1);
constexpr std::size_t max_channels = 12;  // of one joint

struct Channel {
    std::size_t axis = 0;  // 0, 1, 2: x, y, z
    bool rotation = false;
};

struct BvhJoint {
    std::string name;
    std::size_t parent = no_parent;
    Vector3d offset{};
    bool has_offset = false;
    bool end_site = false;
    bool channels_repeat_offset = false;
    std::vector<Channel> channels;
};

struct Hierarchy {
    std::vector<BvhJoint> joints;  // parents before children
    std::size_t channel_count = 0;
};

// Words separated by white space, with the line for messages.
struct WordReader {
    std::string_view text;
    std::size_t position = 0;
    std::size_t line = 1;

    void skip_space() {
        for (; position < text.size() && static_cast<unsigned char>(text[position]) <= ' '; ++position)
            line += text[position] == '\n';
    }
    // The next word; empty at the end. Braces stand alone.
    std::string_view word() {
        skip_space();
        const std::size_t begin = position;
        const auto ends = [&](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '{' || c == '}'; };
        while (position < text.size() && !ends(text[position])) ++position;
        if (position == begin && position < text.size()) ++position;
        return text.substr(begin, position - begin);
    }
    // The rest of the line up to a brace, without surrounding spaces: names may contain spaces.
    std::string_view name() {
        while (position < text.size() && (text[position] == ' ' || text[position] == '\t')) ++position;
        const std::size_t begin = position;
        while (position < text.size() && text[position] != '\n' && text[position] != '\r' && text[position] != '{')
            ++position;
        std::string_view found = text.substr(begin, position - begin);
        while (!found.empty() && static_cast<unsigned char>(found.back()) <= ' ') found.remove_suffix(1);
        return found;
    }
};

bool same_word(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

tl::unexpected<Error> fail_on_line(const WordReader& words, const std::string& message) {
    return fail(ErrorKind::bad_input, "BVH line " + std::to_string(words.line) + ": " + message);
}

// The first characters of a word, in quotes.
std::string quoted(std::string_view word) {
    std::string text("\"");
    text.append(word.substr(0, 40)).append("\"");
    return text;
}

Result<void> expect_word(WordReader& words, std::string_view expected) {
    const auto found = words.word();
    if (same_word(found, expected)) return {};
    return fail_on_line(words, "expected " + std::string(expected) + ", found " +
                                   (found.empty() ? "the end of the file" : quoted(found)));
}

bool parse_number(std::string_view word, double& value) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto end = word.data() + word.size();
    const auto result = std::from_chars(word.data(), end, value);
    return result.ec == std::errc() && result.ptr == end && std::isfinite(value);
}

Result<void> read_offset(WordReader& words, BvhJoint& joint) {
    for (double& coordinate : joint.offset)
        if (!parse_number(words.word(), coordinate))
            return fail_on_line(words, "OFFSET of \"" + joint.name + "\" must be three numbers");
    joint.has_offset = true;
    return {};
}

Result<void> read_channels(WordReader& words, BvhJoint& joint) {
    const auto count_word = words.word();
    std::size_t count = 0;
    const auto parsed = std::from_chars(count_word.data(), count_word.data() + count_word.size(), count);
    if (parsed.ec != std::errc() || parsed.ptr != count_word.data() + count_word.size() || count > max_channels)
        return fail_on_line(words, "CHANNELS of \"" + joint.name + "\" must start with their number, at most " +
                                       std::to_string(max_channels));
    if (!joint.channels.empty()) return fail_on_line(words, "\"" + joint.name + "\" has CHANNELS twice");
    for (std::size_t c = 0; c < count; ++c) {
        const auto word = words.word();
        const std::size_t axis = word.empty() ? 3 : static_cast<std::size_t>((word[0] | 0x20) - 'x');
        const auto kind = word.substr(std::min<std::size_t>(1, word.size()));
        if (axis < 3 && same_word(kind, "scale"))
            return fail(ErrorKind::unsupported, "BVH line " + std::to_string(words.line) +
                                                    ": scale channels are not supported; export without them");
        if (axis >= 3 || !(same_word(kind, "position") || same_word(kind, "rotation")))
            return fail_on_line(words, quoted(word) + " is not a channel (Xposition ... Zrotation)");
        joint.channels.push_back({axis, same_word(kind, "rotation")});
    }
    return {};
}

// Adds a joint below `parent` and reads its opening brace.
Result<void> open_joint(WordReader& words, Hierarchy& hierarchy, std::size_t parent, bool end_site) {
    BvhJoint joint;
    joint.parent = parent;
    joint.end_site = end_site;
    if (end_site) {
        if (const auto site = expect_word(words, "Site"); !site) return site;
        joint.name = hierarchy.joints[parent].name + " end";
    } else {
        joint.name = std::string(words.name());
        if (joint.name.empty()) return fail_on_line(words, "a joint has no name");
    }
    if (const auto brace = expect_word(words, "{"); !brace) return brace;
    if (hierarchy.joints.size() >= max_skeleton_joints)
        return fail(ErrorKind::limit, "BVH line " + std::to_string(words.line) + ": more than the limit of " +
                                          std::to_string(max_skeleton_joints) + " joints");
    hierarchy.joints.push_back(std::move(joint));
    return {};
}

Result<void> close_joint(const WordReader& words, Hierarchy& hierarchy, std::size_t index) {
    const BvhJoint& joint = hierarchy.joints[index];
    if (!joint.has_offset) return fail_on_line(words, "\"" + joint.name + "\" has no OFFSET");
    return {};
}

Result<Hierarchy> read_hierarchy(WordReader& words) {
    Hierarchy hierarchy;
    for (const char* keyword : {"HIERARCHY", "ROOT"})
        if (const auto found = expect_word(words, keyword); !found) return tl::unexpected(found.error());
    if (const auto root = open_joint(words, hierarchy, no_parent, false); !root) return tl::unexpected(root.error());
    std::vector<std::size_t> open = {0};
    while (!open.empty()) {
        const std::size_t index = open.back();
        const auto word = words.word();
        Result<void> done;
        const bool end_site = same_word(word, "End");
        if ((end_site || same_word(word, "JOINT")) && !hierarchy.joints[index].end_site) {
            done = open_joint(words, hierarchy, index, end_site);
            open.push_back(hierarchy.joints.size() - 1);
        } else if (same_word(word, "OFFSET")) {
            done = read_offset(words, hierarchy.joints[index]);
        } else if (same_word(word, "CHANNELS") && !hierarchy.joints[index].end_site) {
            done = read_channels(words, hierarchy.joints[index]);
        } else if (word == "}") {
            done = close_joint(words, hierarchy, index);
            open.pop_back();
        } else {
            done = fail_on_line(words, quoted(word) + " does not belong inside \"" + hierarchy.joints[index].name +
                                           "\"" + (word.empty() ? ": the file ends there" : ""));
        }
        if (!done) return tl::unexpected(done.error());
    }
    for (const auto& joint : hierarchy.joints) hierarchy.channel_count += joint.channels.size();
    return hierarchy;
}

struct MotionHeader {
    std::size_t frames = 0;
    double seconds_per_frame = 0;
};

Result<MotionHeader> read_motion_header(WordReader& words, const Hierarchy& hierarchy) {
    MotionHeader header;
    const auto first = words.word();
    if (same_word(first, "ROOT"))
        return fail(ErrorKind::unsupported,
                    "BVH line " + std::to_string(words.line) + ": a second ROOT; keep one skeleton in the file");
    if (!same_word(first, "MOTION")) return fail_on_line(words, "expected MOTION after the hierarchy");
    if (const auto found = expect_word(words, "Frames:"); !found) return tl::unexpected(found.error());
    const auto count = words.word();
    const auto parsed = std::from_chars(count.data(), count.data() + count.size(), header.frames);
    if (parsed.ec != std::errc() || parsed.ptr != count.data() + count.size())
        return fail_on_line(words, "Frames: must be followed by their number");
    for (const char* keyword : {"Frame", "Time:"})
        if (const auto found = expect_word(words, keyword); !found) return tl::unexpected(found.error());
    if (!parse_number(words.word(), header.seconds_per_frame) || header.seconds_per_frame < 1e-6 ||
        header.seconds_per_frame > 1000)
        return fail_on_line(words, "Frame Time: must be a number of seconds from 0.000001 to 1000");
    // Frames take memory in proportion to the joints, of which a hierarchy can have many without any channel.
    const std::size_t joints = hierarchy.joints.size();
    if (header.frames > 0 && (hierarchy.channel_count == 0 || header.frames > words.text.size() ||
                              header.frames * joints > std::max<std::size_t>(words.text.size(), 1 << 16)))
        return fail(ErrorKind::limit, "BVH line " + std::to_string(words.line) + ": " + std::to_string(header.frames) +
                                          " frames of " + std::to_string(joints) +
                                          " joints are far more than the file has values for");
    return header;
}

Result<std::vector<double>> read_frame(WordReader& words, const Hierarchy& hierarchy, std::size_t frame) {
    std::vector<double> values(hierarchy.channel_count);
    std::size_t next = 0;
    for (const auto& joint : hierarchy.joints)
        for (std::size_t c = 0; c < joint.channels.size(); ++c, ++next) {
            const auto word = words.word();
            if (parse_number(word, values[next])) continue;
            return fail_on_line(words, "frame " + std::to_string(frame) + " (the first is 0), channel " +
                                           std::to_string(c) + " of joint \"" + joint.name +
                                           "\": " + (word.empty() ? "the file ends there" : "is not a number"));
        }
    return values;
}

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
void settle_position_channels(Hierarchy& hierarchy, const std::vector<double>& frame, std::vector<std::string>& notes) {
    std::size_t next = 0;
    for (auto& joint : hierarchy.joints) {
        const Vector3d position = channel_position(joint, frame.data() + next);
        next += joint.channels.size();
        const bool has_position =
            std::any_of(joint.channels.begin(), joint.channels.end(), [](Channel c) { return !c.rotation; });
        if (!has_position || joint.offset == Vector3d{}) continue;
        joint.channels_repeat_offset = distance(position, joint.offset) < distance(position, {});
        notes.push_back("BVH joint \"" + joint.name + "\": position channels taken " +
                        (joint.channels_repeat_offset ? "in place of" : "on top of") + " its OFFSET.");
    }
}

struct GlobalPose {
    std::vector<Vector3d> positions;  // file units
    std::vector<Rotation> rotations;
};

// Forward kinematics; without values: the rest pose.
GlobalPose forward_kinematics(const Hierarchy& hierarchy, const std::vector<double>* values) {
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
        if (joint.parent == no_parent) {
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

double guess_unit(double height, std::vector<std::string>& notes) {
    const double mm = height < 10 ? 1000 : height < 600 ? 10 : 1;
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, height, std::chars_format::general, 4);
    notes.push_back("BVH has no units: its skeleton is " + std::string(text, end.ptr) + " units tall, taken as " +
                    (mm == 1000 ? "metres"
                     : mm == 10 ? "centimetres"
                                : "millimetres") +
                    ".");
    return mm;
}

Result<Pose> pose_in_mm(const Hierarchy& hierarchy, const GlobalPose& global, double scale, std::size_t frame) {
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
        if (hierarchy.joints[j].parent != no_parent)
            pose.orientations.push_back(global.rotations[hierarchy.joints[j].parent]);
    }
    return pose;
}

}  // namespace

Result<SkeletonTrack> parse_skeleton_bvh(std::string_view text, const BvhOptions& options) {
    if (!(options.mm_per_unit >= 0) || options.mm_per_unit > 1e6)
        return fail(ErrorKind::bad_input, "the unit of a BVH file must be 0 (guessed) or a positive number of mm");
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    WordReader words{text};
    auto hierarchy = read_hierarchy(words);
    if (!hierarchy) return tl::unexpected(hierarchy.error());
    if (hierarchy->joints.size() < 2)
        return fail(ErrorKind::bad_input, "the BVH hierarchy has a single joint and so no bone");
    const auto header = read_motion_header(words, *hierarchy);
    if (!header) return tl::unexpected(header.error());

    SkeletonTrack track;
    track.fps = 1 / header->seconds_per_frame;
    for (std::size_t j = 0; j < hierarchy->joints.size(); ++j) {
        const auto& joint = hierarchy->joints[j];
        track.skeleton.joint_names.push_back(joint.name);
        if (joint.parent != no_parent)
            track.skeleton.bones.push_back({static_cast<std::uint16_t>(joint.parent), static_cast<std::uint16_t>(j)});
    }
    double scale = options.mm_per_unit;
    for (std::size_t t = 0; t < header->frames; ++t) {
        const auto values = read_frame(words, *hierarchy, t);
        if (!values) return tl::unexpected(values.error());
        if (t == 0) settle_position_channels(*hierarchy, *values, track.notes);
        const GlobalPose global = forward_kinematics(*hierarchy, &*values);
        if (scale == 0) {
            const double rest = largest_extent(forward_kinematics(*hierarchy, nullptr));
            scale = guess_unit(std::max(rest, largest_extent(global)), track.notes);
        }
        auto pose = pose_in_mm(*hierarchy, global, scale, t);
        if (!pose) return tl::unexpected(pose.error());
        track.poses.push_back(std::move(*pose));
        track.timestamps.push_back(static_cast<double>(t) * header->seconds_per_frame);
    }
    if (!words.word().empty())
        track.notes.push_back("The BVH file goes on after its " + std::to_string(header->frames) +
                              " frames: the rest is ignored.");
    return track;
}

}  // namespace htvm
