#include "io/skeleton_rate.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace htvm {
namespace {

// At most so much apart, in parts of the longer one.
constexpr double unlike = 1.0 / 3;

std::string number(double value) {
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 4);
    return std::string(text, end.ptr);
}

bool are_unlike(double a, double b) { return std::abs(a - b) > unlike * std::max(a, b); }

// How many poses there are for each mesh, if that is a whole number above 1.
std::optional<std::size_t> poses_for_each(double poses, std::size_t mesh_frames) {
    constexpr double tolerance = 0.05, most = 16;
    const double ratio = poses / static_cast<double>(mesh_frames);
    const double whole = std::round(ratio);
    if (whole < 2 || whole > most || std::abs(ratio / whole - 1) > tolerance) return std::nullopt;
    return static_cast<std::size_t>(whole);
}

// The usual rate nearest to that of so many frames in so many seconds, if there is one.
std::optional<double> usual_rate(double seconds, std::size_t mesh_frames) {
    constexpr double tolerance = 0.02;
    constexpr std::array rates = {10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 90.0, 100.0, 120.0};
    const double fps = static_cast<double>(mesh_frames) / seconds;
    const auto nearest = std::min_element(rates.begin(), rates.end(),
                                          [&](double a, double b) { return std::abs(a - fps) < std::abs(b - fps); });
    if (std::abs(fps / *nearest - 1) > tolerance) return std::nullopt;
    return *nearest;
}

}  // namespace

double duration_of(const SkeletonTrack& track) {
    return track.timestamps.empty() ? 0 : track.timestamps.back() - track.timestamps.front() + 1 / track.fps;
}

MeshRate mesh_rate_beside(const SkeletonTrack& track, std::size_t mesh_frames) {
    MeshRate out{track.fps, {}, false};
    const double seconds = duration_of(track);
    if (mesh_frames < 2 || seconds <= 0 || !are_unlike(seconds * track.fps, static_cast<double>(mesh_frames)))
        return out;
    const std::string poses = std::to_string(track.poses.size()) + " poses at " + number(track.fps) +
                              " a second last " + number(seconds) + " s";
    const std::string meshes = std::to_string(mesh_frames) + " meshes";
    if (const auto each = poses_for_each(seconds * track.fps, mesh_frames)) {
        out.fps = track.fps / static_cast<double>(*each);
        out.note = "The " + poses + ", " + std::to_string(*each) + " for each of the " + meshes +
                   ": these are taken at " + number(out.fps) + " a second (--fps says otherwise).";
    } else if (const auto usual = usual_rate(seconds, mesh_frames)) {
        out.fps = *usual;
        out.note = "The " + poses + ", as the " + meshes + " do at " + number(out.fps) +
                   " a second: these are taken at that rate (--fps says otherwise).";
    } else {
        out.note = "The " + poses + ", the " + meshes + " at that rate " +
                   number(static_cast<double>(mesh_frames) / track.fps) +
                   " s: if the meshes have another rate, give --fps.";
        out.is_doubtful = true;
    }
    return out;
}

std::string unlike_durations(const SkeletonTrack& track, double mesh_seconds) {
    const double seconds = duration_of(track);
    if (seconds <= 0 || mesh_seconds <= 0 || !are_unlike(seconds, mesh_seconds)) return {};
    return "The skeleton lasts " + number(seconds) + " s, the meshes " + number(mesh_seconds) +
           " s: if they are of one recording, one of the rates is wrong.";
}

void take_rate_of_meshes(SkeletonTrack& track, double fps, std::size_t mesh_frames) {
    const auto each = mesh_frames > 1 ? poses_for_each(static_cast<double>(track.poses.size()), mesh_frames)
                                      : std::optional<std::size_t>{};
    track.fps = fps * static_cast<double>(each.value_or(1));
    for (std::size_t t = 0; t < track.timestamps.size(); ++t) track.timestamps[t] = static_cast<double>(t) / track.fps;
    track.notes.push_back("The file says no rate: its poses are taken at " + number(track.fps) + " a second" +
                          (each ? ", " + std::to_string(*each) + " for each mesh." : ", one for each mesh."));
}

}  // namespace htvm
