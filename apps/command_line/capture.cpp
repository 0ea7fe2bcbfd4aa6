#include "command_line/capture.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <utility>

#include "command_line/terminal.h"
#include "io/mesh_file.h"
#include "io/skeleton_align.h"
#include "io/skeleton_file.h"

namespace htvm::app {
namespace {

const char* unit_name(double millimetres) {
    return millimetres == 1000 ? "metres" : millimetres == 10 ? "centimetres" : "millimetres";
}

}  // namespace

void add_capture_options(CLI::App& command, CaptureOptions& options) {
    command
        .add_option("input", options.input,
                    "The meshes, one file per frame (.ply, .obj, .drc): a folder, a pattern such as scan_%05d.ply, a\n"
                    "quoted glob such as 'scan_*.ply', one file, or - for concatenated PLY on standard input")
        ->type_name("FILE")
        ->required();
    command
        .add_option("-s,--skeleton", options.skeleton,
                    "The tracked skeleton: htvm's JSON (docs/skeleton.md), BVH, or Azure Kinect's JSON. Without\n"
                    "one, a single bone that spans the mesh is used, and fast limbs cost more bits")
        ->type_name("FILE");
    command.add_option("--fps", options.fps, "Frames per second of the meshes (default: the skeleton's rate, else 30)")
        ->check(CLI::PositiveNumber);
    command.add_option("--unit", options.unit, "Unit of the mesh files (default: guessed from the first mesh's size)")
        ->check(CLI::IsMember({"auto", "mm", "cm", "m"}));
    command.add_option("--frames", options.frames, "Use at most this many frames (default: all)");
    command.add_option("--first", options.first, "Skip this many frames at the beginning (default: 0)");
    command.add_option("--skeleton-offset", options.skeleton_offset,
                       "Seconds to add to the skeleton's clock, if it is early or late");
}

Result<double> millimetres_of_unit(const std::string& name) {
    if (name == "mm") return 1.0;
    if (name == "cm") return 10.0;
    if (name == "m") return 1000.0;
    return fail(ErrorKind::bad_input, "the unit '" + name + "' is not one of mm, cm, m");
}

Result<Capture> Capture::open(const CaptureOptions& options) {
    Capture capture;
    capture.options_ = options;
    if (options.input == "-") {
        capture.stream_ = std::make_unique<PlyStreamReader>(std::cin);
    } else {
        auto files = find_sequence(options.input);
        if (!files) return tl::unexpected(files.error());
        capture.files_ = std::move(*files);
        const std::size_t found = capture.files_.paths.size();
        if (options.first >= found)
            return fail(ErrorKind::bad_input,
                        fmt::format("--first {} leaves nothing: there are {} frames", options.first, found));
        capture.frames_ = found - options.first;
        if (options.frames > 0) capture.frames_ = std::min(capture.frames_, options.frames);
    }
    if (options.unit != "auto") {
        auto unit = millimetres_of_unit(options.unit);
        if (!unit) return tl::unexpected(unit.error());
        capture.millimetres_per_unit_ = *unit;
    }
    capture.fps_ = options.fps > 0 ? options.fps : 30;
    std::optional<SkeletonTrack> track;
    if (!options.skeleton.empty()) {
        auto read = read_skeleton(options.skeleton);
        if (!read) return tl::unexpected(read.error());
        track = std::move(*read);
        if (options.fps <= 0 && track->fps > 0) capture.fps_ = track->fps;
    }
    // If file names are numbered, a gap in the numbers is a gap in time.
    const auto& numbers = capture.files_.numbers;
    for (std::size_t k = 0; k < numbers.size(); ++k)
        capture.timestamps_.push_back(static_cast<double>(numbers[k] - numbers[0]) / capture.fps_);
    if (track) {
        MeshClock clock;
        clock.frames = capture.stream_ ? track->poses.size() : capture.files_.paths.size();
        clock.fps = capture.fps_;
        clock.timestamps = capture.timestamps_;
        AlignOptions align_options;
        align_options.offset = options.skeleton_offset;
        auto aligned = align(*track, clock, align_options);
        if (!aligned) return fail(aligned.error().kind, options.skeleton + ": " + aligned.error().message);
        for (const auto& line : track->notes) note("skeleton: " + line);
        for (const auto& line : aligned->notes) note("skeleton: " + line);
        capture.poses_ = std::move(aligned->poses);
        capture.skeleton_ = std::move(track->skeleton);
        capture.radii_ = std::move(track->radii);
    } else {
        note("no skeleton given: one bone that spans the mesh stands in (see --skeleton)");
    }
    if (auto ok = capture.peek(); !ok) return tl::unexpected(ok.error());
    return capture;
}

// Reads the first mesh, which determines the unit of all.
Result<void> Capture::peek() {
    auto mesh = read_next();
    if (!mesh) return tl::unexpected(mesh.error());
    if (!*mesh) return fail(ErrorKind::bad_input, "there is no mesh in " + options_.input);
    if (millimetres_per_unit_ == 0) {
        millimetres_per_unit_ = millimetres_per(guess_unit(**mesh));
        if (millimetres_per_unit_ != 1)
            note(fmt::format("the meshes look as if they were in {} (see --unit)", unit_name(millimetres_per_unit_)));
        if (auto ok = scale_positions(**mesh, millimetres_per_unit_); !ok) return ok;
    }
    peeked_ = std::move(**mesh);
    return {};
}

// In the unit of the files until that is known, then in mm.
Result<std::optional<Mesh>> Capture::read_next() {
    if (stream_) {
        for (; read_ < options_.first; ++read_)
            if (auto mesh = stream_->next(); !mesh || !*mesh) return mesh;
        auto mesh = stream_->next();
        if (!mesh || !*mesh) return mesh;
        ++read_;
        if (millimetres_per_unit_ > 0)
            if (auto ok = scale_positions(**mesh, millimetres_per_unit_); !ok) return tl::unexpected(ok.error());
        return mesh;
    }
    if (read_ >= frames_) return std::optional<Mesh>{};
    MeshFileOptions options;
    if (millimetres_per_unit_ > 0) options.millimetres_per_unit = millimetres_per_unit_;
    auto mesh = read_mesh(files_.paths[options_.first + read_], options);
    if (!mesh) return tl::unexpected(mesh.error());
    ++read_;
    return std::optional<Mesh>{std::move(*mesh)};
}

Result<std::optional<Mesh>> Capture::next() {
    if (options_.frames > 0 && given_ >= options_.frames) return std::optional<Mesh>{};
    if (peeked_) {
        ++given_;
        return std::exchange(peeked_, std::nullopt);
    }
    auto mesh = read_next();
    if (mesh && *mesh) ++given_;
    return mesh;
}

void Capture::rewind() {
    peeked_.reset();
    read_ = given_ = 0;
}

const Pose* Capture::pose() const {
    if (poses_.empty()) return nullptr;
    return &poses_[std::min(options_.first + given_ - 1, poses_.size() - 1)];
}

std::int64_t Capture::timestamp_us() const {
    const std::size_t index = options_.first + given_ - 1;
    const double seconds = timestamps_.empty() ? static_cast<double>(index) / fps_ : timestamps_[index];
    return std::llround(seconds * 1e6);
}

}  // namespace htvm::app
