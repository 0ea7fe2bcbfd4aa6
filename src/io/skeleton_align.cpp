#include "io/skeleton_align.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/orientation.h"

namespace htvm {

using namespace internal;
namespace {

constexpr double same_time = 0.0002;  // s: in this time a hand at 5 m/s moves 1 mm

std::string number(double value) {
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 5);
    return std::string(text, end.ptr);
}

std::string counted(std::size_t count, const char* noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

bool finite(const Vector3d& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

bool is_tracked(const Pose& pose, std::size_t joint) {
    return !pose.joints.empty() && (pose.found.empty() || pose.found[joint]);
}

Result<void> check_track(const SkeletonTrack& track) {
    const std::size_t joints = track.skeleton.joint_names.size(), bones = track.skeleton.bones.size();
    for (const Bone& bone : track.skeleton.bones)
        if (bone.first >= joints || bone.second >= joints)
            return fail(ErrorKind::bad_input, "A bone of the skeleton names a joint that it does not have.");
    if (track.timestamps.size() != track.poses.size())
        return fail(ErrorKind::bad_input, "The skeleton has " + counted(track.poses.size(), "pose") + " but " +
                                              counted(track.timestamps.size(), "timestamp") + ".");
    if (!(track.fps > 0) || !std::isfinite(track.fps))
        return fail(ErrorKind::bad_input, "The skeleton's rate must be a positive number of poses per second.");
    for (std::size_t t = 0; t < track.poses.size(); ++t) {
        const std::string place = "The skeleton's pose " + std::to_string(t) + " (the first is 0)";
        const Pose& pose = track.poses[t];
        if (!std::isfinite(track.timestamps[t]) || (t > 0 && track.timestamps[t] <= track.timestamps[t - 1]))
            return fail(ErrorKind::bad_input, place + " has a timestamp that is not after the previous one.");
        if (pose.joints.empty()) continue;
        if (pose.joints.size() != joints || (!pose.found.empty() && pose.found.size() != joints) ||
            (!pose.orientations.empty() && pose.orientations.size() != bones))
            return fail(ErrorKind::bad_input, place + " does not fit its joints and bones.");
        for (std::size_t j = 0; j < joints; ++j)
            if (is_tracked(pose, j) && !finite(pose.joints[j]))
                return fail(ErrorKind::bad_input, place + " has a position that is not finite, joint \"" +
                                                      track.skeleton.joint_names[j] + "\".");
    }
    return {};
}

Result<void> check_mesh(const MeshClock& mesh) {
    if (!(mesh.fps >= 0) || !std::isfinite(mesh.fps))
        return fail(ErrorKind::bad_input, "The meshes' rate must be a positive number of frames per second.");
    if (mesh.timestamps.empty()) return {};
    if (mesh.timestamps.size() != mesh.frames)
        return fail(ErrorKind::bad_input, "There are " + counted(mesh.frames, "mesh frame") + " but " +
                                              counted(mesh.timestamps.size(), "mesh timestamp") + ".");
    for (std::size_t t = 0; t < mesh.frames; ++t)
        if (!std::isfinite(mesh.timestamps[t]) || (t > 0 && mesh.timestamps[t] < mesh.timestamps[t - 1]))
            return fail(ErrorKind::bad_input,
                        "The timestamp of mesh frame " + std::to_string(t) + " (the first is 0) is out of order.");
    return {};
}

// Whether pose i belongs to mesh frame i: there is no mesh clock, or it agrees with that of the poses.
bool frame_by_frame(const SkeletonTrack& track, const MeshClock& mesh) {
    if (mesh.fps == 0) return true;
    if (track.poses.size() == mesh.frames && std::abs(track.fps / mesh.fps - 1) <= 0.005) {
        const double span = track.timestamps.empty() ? 0 : track.timestamps.back() - track.timestamps.front();
        // Otherwise the tracker dropped frames and went on after the meshes had ended.
        if (std::abs(span * mesh.fps - static_cast<double>(mesh.frames) + 1) <=
            0.5 + 0.005 * static_cast<double>(mesh.frames))
            return true;
    }
    for (std::size_t t = 0; t < track.timestamps.size(); ++t) {
        const double expected = track.timestamps[0] + static_cast<double>(t) / mesh.fps;
        if (std::abs(track.timestamps[t] - expected) * mesh.fps > 0.1) return false;
    }
    return true;
}

// The times of the mesh frames on the track's clock.
std::vector<double> mesh_times(const SkeletonTrack& track, const MeshClock& mesh, double offset,
                               std::vector<std::string>& notes) {
    std::vector<double> times;
    const auto& stamps = track.timestamps;  // not empty
    const std::string skeleton_rate = "The skeleton has " + number(track.fps) + " poses per second";
    if (!mesh.timestamps.empty()) {
        double shift = -offset;
        const bool apart =
            mesh.timestamps.back() + shift < stamps.front() || mesh.timestamps.front() + shift > stamps.back();
        if (apart) {
            shift = stamps.front() - mesh.timestamps.front();
            notes.push_back("The timestamps of skeleton and meshes do not overlap: both are taken to start together.");
        }
        for (const double seconds : mesh.timestamps) times.push_back(seconds + shift);
        return times;
    }
    if (frame_by_frame(track, mesh) && offset == 0) {
        for (std::size_t t = 0; t < mesh.frames; ++t)
            times.push_back(t < stamps.size() ? stamps[t]
                                              : stamps.back() + static_cast<double>(t + 1 - stamps.size()) / track.fps);
        if (mesh.fps == 0 && mesh.frames != stamps.size())
            notes.push_back("The meshes' rate is not known: pose i is used for mesh frame i.");
        return times;
    }
    const double fps = mesh.fps > 0 ? mesh.fps : track.fps;
    notes.push_back(std::abs(track.fps / fps - 1) <= 0.005
                        ? skeleton_rate +
                              " but not at even times or not from the meshes' start: poses are interpolated by time."
                        : skeleton_rate + ", the meshes " + number(fps) + ": poses are interpolated by time.");
    for (std::size_t t = 0; t < mesh.frames; ++t)
        times.push_back(stamps.front() - offset + static_cast<double>(t) / fps);
    return times;
}

// Where a time lies among the samples of one joint or bone: at `fraction` of the way from sample `before` to sample
// `after` (equal if one is taken as it is, or held).
struct Place {
    std::size_t before = 0, after = 0;
    double fraction = 0;
    bool held = false;
};

// samples: pose indices, increasing, at least one.
Place find_place(const std::vector<std::size_t>& samples, const std::vector<double>& timestamps, double time) {
    const auto earlier = [&](std::size_t sample, double bound) { return timestamps[sample] < bound; };
    const auto next = std::lower_bound(samples.begin(), samples.end(), time - same_time, earlier);
    if (next == samples.end()) return {samples.back(), samples.back(), 0, true};
    // Two samples are within the tolerance of this time: take the nearer.
    if (next + 1 != samples.end() && std::abs(timestamps[next[1]] - time) < std::abs(timestamps[*next] - time))
        if (std::abs(timestamps[next[1]] - time) <= same_time) return {next[1], next[1], 0, false};
    if (timestamps[*next] - time <= same_time) return {*next, *next, 0, false};
    if (next == samples.begin()) return {*next, *next, 0, true};
    const std::size_t before = next[-1], after = *next;
    return {before, after, (time - timestamps[before]) / (timestamps[after] - timestamps[before]), false};
}

struct FillCount {
    std::size_t of = 0;      // number of frames counted
    std::size_t joints = 0;  // number of joints filled in, over all frames
    std::size_t frames = 0;  // number of frames with some
    std::size_t whole = 0;   // number of frames with all
    std::size_t beyond = 0;  // number of those before the first or after the last pose,
    std::size_t before = 0;  // of which so many are before the first
    std::size_t last = 0;    // the last frame counted
    std::vector<std::string> never;
};

// Fills in joint j of all poses from the poses that track it.
void fill_joint(const SkeletonTrack& track, const std::vector<double>& times, std::size_t j,
                const std::vector<std::size_t>& samples, std::vector<Pose>& poses) {
    for (std::size_t t = 0; t < times.size(); ++t) {
        const Place place = find_place(samples, track.timestamps, times[t]);
        const Vector3d& a = track.poses[place.before].joints[j];
        const Vector3d& b = track.poses[place.after].joints[j];
        for (std::size_t axis = 0; axis < 3; ++axis)
            poses[t].joints[j][axis] = a[axis] + (b[axis] - a[axis]) * place.fraction;
        const double gap = track.timestamps[place.after] - track.timestamps[place.before];
        poses[t].found[j] = !place.held && place.after - place.before <= 1 && gap * track.fps <= 1.5;
    }
}

// Puts a joint that no pose has where the nearest joint along the bones is, or else at the first joint that is known.
void place_lost_joints(const Skeleton& skeleton, std::vector<bool> known, std::vector<Pose>& poses) {
    const auto copy = [&](std::size_t from, std::size_t to) {
        for (Pose& pose : poses) pose.joints[to] = pose.joints[from];
        known[to] = true;
    };
    for (bool changed = true; changed;) {
        changed = false;
        const std::vector<bool> before = known;  // one bone further per round, so the nearest wins
        for (const Bone& bone : skeleton.bones)
            for (const auto& [from, to] : {std::pair(bone.first, bone.second), std::pair(bone.second, bone.first)})
                if (before[from] && !known[to]) copy(from, to), changed = true;
    }
    const std::size_t first = static_cast<std::size_t>(std::find(known.begin(), known.end(), true) - known.begin());
    for (std::size_t j = 0; j < known.size(); ++j)
        if (!known[j]) copy(first, j);
}

Result<FillCount> fill_joints(const SkeletonTrack& track, const std::vector<double>& times, const AlignOptions& options,
                              std::vector<Pose>& poses) {
    const std::size_t joints = track.skeleton.joint_names.size();
    FillCount count;
    const std::size_t first = std::min(options.first_used, poses.size());
    count.of = options.used > 0 ? std::min(options.used, poses.size() - first) : poses.size() - first;
    std::vector<bool> known(joints, false);
    for (Pose& pose : poses) {
        pose.joints.assign(joints, Vector3d{});
        pose.found.assign(joints, false);
    }
    std::vector<std::size_t> samples;
    for (std::size_t j = 0; j < joints; ++j) {
        samples.clear();
        for (std::size_t p = 0; p < track.poses.size(); ++p)
            if (is_tracked(track.poses[p], j)) samples.push_back(p);
        known[j] = !samples.empty();
        if (known[j])
            fill_joint(track, times, j, samples, poses);
        else
            count.never.push_back(track.skeleton.joint_names[j]);
    }
    if (count.never.size() == joints)
        return fail(ErrorKind::bad_input, "The skeleton has no frame with a tracked joint; leave it out.");
    if (!count.never.empty()) place_lost_joints(track.skeleton, known, poses);
    for (std::size_t t = first; t < first + count.of; ++t) {
        const auto filled = static_cast<std::size_t>(std::count(poses[t].found.begin(), poses[t].found.end(), false));
        const bool before = times[t] < track.timestamps.front() - same_time;
        const bool outside = before || times[t] > track.timestamps.back() + same_time;
        count.joints += filled;
        count.frames += filled > 0;
        count.whole += filled == joints;
        count.beyond += outside;
        count.before += before;
        count.last = t;
    }
    return count;
}

// "the first 3" and "frames 40 to 59 (the first is 0)", or one of both.
std::string frames_beyond(const FillCount& count) {
    const std::size_t behind = count.beyond - count.before;
    std::string text = count.before > 0 ? "the first " + std::to_string(count.before) : "";
    if (behind == 0) return text;
    const std::string last = std::to_string(count.last);
    text += text.empty() ? "" : ", ";
    if (behind == 1) return text + "frame " + last;
    return text + "frames " + std::to_string(count.last + 1 - behind) + " to " + last + " (the first is 0)";
}

void say_filled(const FillCount& count, std::vector<std::string>& notes) {
    if (count.beyond > 0)
        notes.push_back("The skeleton does not cover " + counted(count.beyond, "mesh frame") + " of " +
                        std::to_string(count.of) + " at the ends, " + frames_beyond(count) +
                        ": its nearest pose is held there.");
    if (count.whole > count.beyond)
        notes.push_back("The skeleton is missing in " + counted(count.whole - count.beyond, "mesh frame") + " of " +
                        std::to_string(count.of) + ": interpolated.");
    if (count.frames > count.whole)
        notes.push_back("Single joints are missing in " + counted(count.frames - count.whole, "mesh frame") +
                        ": filled in from the nearest frames that have them (" + counted(count.joints, "joint") +
                        " in all, whole frames included).");
    for (const auto& name : count.never)
        notes.push_back("Joint \"" + name + "\" is tracked in no frame: put where its neighbour is.");
}

Rotation blend(const Rotation& a, const Rotation& b, double fraction) {
    if (fraction == 0 || a == b) return a;
    // For similar poses, the mean of the matrices interpolates turns evenly enough; for very different ones there is no
    // good answer.
    double trace = 0;
    for (std::size_t i = 0; i < 9; ++i) trace += a[i] * b[i];
    if (trace < 0) return fraction < 0.5 ? a : b;  // more than 120 degrees apart
    Rotation mean;
    for (std::size_t i = 0; i < 9; ++i) mean[i] = a[i] + (b[i] - a[i]) * fraction;
    return orthonormalised(mean);
}

// Blends the orientations that the track has, at these times; bones without any in all frames stay unknown. Returns how
// many bones have some.
std::size_t blend_orientations(const SkeletonTrack& track, const std::vector<double>& times, std::vector<Pose>& poses) {
    const std::size_t bones = track.skeleton.bones.size();
    std::size_t given = 0;
    std::vector<std::size_t> samples;
    for (std::size_t b = 0; b < bones; ++b) {
        samples.clear();
        for (std::size_t p = 0; p < track.poses.size(); ++p)
            if (!track.poses[p].orientations.empty() && track.poses[p].orientations[b] != unknown_orientation)
                samples.push_back(p);
        if (samples.empty()) continue;
        ++given;
        for (std::size_t t = 0; t < times.size(); ++t) {
            if (poses[t].orientations.empty()) poses[t].orientations.assign(bones, unknown_orientation);
            const Place place = find_place(samples, track.timestamps, times[t]);
            poses[t].orientations[b] = blend(track.poses[place.before].orientations[b],
                                             track.poses[place.after].orientations[b], place.fraction);
        }
    }
    return given;
}

void derive_missing_orientations(const Skeleton& skeleton, std::vector<Pose>& poses) {
    Pose reference;
    reference.joints = poses.front().joints;
    for (Pose& pose : poses) {
        const auto derived = derive_turning_orientations(skeleton, pose, reference);
        if (pose.orientations.empty()) pose.orientations.assign(skeleton.bones.size(), unknown_orientation);
        for (std::size_t b = 0; b < derived.size(); ++b)
            if (pose.orientations[b] == unknown_orientation) pose.orientations[b] = derived[b];
    }
}

}  // namespace

Result<AlignedPoses> align(const SkeletonTrack& track, const MeshClock& mesh, const AlignOptions& options) {
    if (const auto checked = check_track(track); !checked) return tl::unexpected(checked.error());
    if (const auto checked = check_mesh(mesh); !checked) return tl::unexpected(checked.error());
    if (!std::isfinite(options.offset))
        return fail(ErrorKind::bad_input, "The skeleton's time offset must be a number of seconds.");
    AlignedPoses aligned;
    if (mesh.frames == 0) return aligned;
    if (track.poses.empty())
        return fail(ErrorKind::bad_input, "The skeleton has no frame with a tracked joint; leave it out.");

    const std::vector<double> times = mesh_times(track, mesh, options.offset, aligned.notes);
    aligned.poses.resize(mesh.frames);
    const auto filled = fill_joints(track, times, options, aligned.poses);
    if (!filled) return tl::unexpected(filled.error());
    say_filled(*filled, aligned.notes);
    const double interval = 1 / (mesh.fps > 0 ? std::min(mesh.fps, track.fps) : track.fps);
    if (times.back() < track.timestamps.back() - interval - same_time)
        aligned.notes.push_back("The skeleton goes on for " + number(track.timestamps.back() - times.back()) +
                                " s after the last mesh frame: not used.");

    const std::size_t given = blend_orientations(track, times, aligned.poses);
    if (given < track.skeleton.bones.size() && options.derive_orientations)
        derive_missing_orientations(track.skeleton, aligned.poses);
    return aligned;
}

}  // namespace htvm
