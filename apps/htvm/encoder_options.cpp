#include "encoder_options.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line/terminal.h"
#include "io/mesh_file.h"

namespace htvm::app {
namespace {

Result<std::vector<double>> read_radii(const std::string& path, std::size_t bones) {
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    const auto json = nlohmann::json::parse(bytes->begin(), bytes->end(), nullptr, false);
    if (!json.is_object() || !json.contains("radii") || !json["radii"].is_array())
        return fail(ErrorKind::bad_input,
                    path + " is not a calibration: it has no list \"radii\" (see htvm calibrate)");
    std::vector<double> radii;
    for (const auto& value : json["radii"]) {
        if (!value.is_number()) return fail(ErrorKind::bad_input, path + ": a radius is not a number");
        radii.push_back(value.get<double>());
    }
    if (radii.size() != bones)
        return fail(ErrorKind::bad_input,
                    fmt::format("{} has {} radii, but the skeleton has {} bones", path, radii.size(), bones));
    return radii;
}

// Which kind of frame a frame becomes.
void add_choice_options(CLI::App& command, EncodingOptions& options) {
    const auto millimetres = CLI::Range(0.0, 1e6);
    command
        .add_option("--min-keyint", options.least_key_interval,
                    "Fewest frames from one I-frame to the next, unless the scene changes (default 1)")
        ->check(CLI::Range(1, 1000000));
    command
        .add_option(
            "--decide", options.decide,
            "topology: choice of frames: fixed (I every --keyint, EP between), motion (by how far the skeleton's "
            "bones\n"
            "are from the last I-frame: --predicted-below, --intra-above), or rd (by measured bits and errors;\n"
            "slow). Default: fixed")
        ->check(CLI::IsMember({"fixed", "motion", "rd"}));
    command
        .add_option("--predicted-below", options.predicted_below,
                    "--decide motion: frames whose bones moved less than this in all, mm, are P-frames: the I-frame's\n"
                    "mesh moved (default 400; see --animation-error)")
        ->check(millimetres);
    command
        .add_option("--intra-above", options.intra_above,
                    "--decide motion: frames whose bones moved more than this in all, mm, are I-frames; 0: never\n"
                    "(default)")
        ->check(millimetres);
    command
        .add_option(
            "--still-below", options.still_below,
            "topology, motion-based coding: the sub-meshes of bones that moved less than this, mm, are animated, the\n"
            "others coded, and both zippered; 0 (default): all are coded")
        ->check(millimetres);
    command
        .add_option("--animation-error", options.animation_error,
                    "topology: what would be animated is coded after all where it is farther than this, mm, from the "
                    "capture's\n"
                    "surface (root mean square, bone by bone; default 2); 0: unchecked, as the paper has it")
        ->check(millimetres);
    command.add_flag("--no-scene-changes", options.no_scene_changes,
                     "No I-frame of its own accord where the scene changes");
}

// Quality that follows from a bitrate or an error. What sets the steps by hand contradicts it.
void add_control_options(CLI::App& command, EncodingOptions& options) {
    auto* bitrate =
        command
            .add_option("--bitrate", options.megabits,
                        "Mbit/s that the stream keeps to, instead of a quality: the quality follows, and frames that\n"
                        "do not fit into the buffer even at the lowest become P-frames or are dropped (exit code 5)")
            ->check(CLI::Range(1e-3, 1e6));
    command
        .add_option("--buffer", options.buffer_seconds,
                    "--bitrate: seconds of stream that the receiver's buffer holds, which is the delay that a live\n"
                    "receiver needs (default 1). A short capture may exceed the bitrate by what it holds")
        ->check(CLI::Range(0.01, 3600.0))
        ->needs(bitrate);
    command
        .add_option("--passes", options.passes,
                    "--bitrate: 2 encodes twice, so that the quality stays even from frame to frame; from files only\n"
                    "(default 1)")
        ->check(CLI::Range(1, 2))
        ->needs(bitrate);
    auto* error =
        command
            .add_option("--target-error", options.target_error,
                        "Error that every frame comes near to, mm, instead of a quality: root mean square\n"
                        "between the surfaces (M2). Where no quality reaches it, the nearest serves; T-frames may\n"
                        "stay well above it")
            ->check(CLI::Range(1e-3, 1e3));
    bitrate->excludes(error);
    for (const char* by_hand : {"--quality", "--geometry-step", "--colour-step"}) {
        bitrate->excludes(command.get_option(by_hand));
        error->excludes(command.get_option(by_hand));
    }
}

FrameChoice frame_choice(const std::string& name) {
    if (name == "fixed") return FrameChoice::fixed;
    if (name == "motion") return FrameChoice::motion;
    return FrameChoice::rate_distortion;
}

}  // namespace

void add_encoding_options(CLI::App& command, EncodingOptions& options) {
    command
        .add_option(
            "-q,--quality", options.quality,
            fmt::format(
                "Quality, 0 to 100 (default {}): the surface is off by about 1.5 mm (M2) at 20, 0.7 at 40, 0.3 at\n"
                "60, 0.1 at 80, in every profile. Steps of positions are 16 mm at 0, 4 mm at 33, 2 mm at 50, 1 mm\n"
                "at 67, 0.25 mm at 100; of colours 32, 10, 5.7, 3.2 and 1 of 255 levels",
                default_quality))
        ->check(CLI::Range(0.0, 100.0));
    command.add_option("--geometry-step", options.geometry_step, "Step of the positions in mm, instead of by quality")
        ->check(CLI::Range(1.0 / 65536, 1000.0));
    command.add_option("--colour-step", options.colour_step, "Step of the colours in levels of 255, likewise")
        ->check(CLI::Range(1.0, 255.0));
    add_control_options(command, options);
    command
        .add_option("--lambda", options.lambda,
                    "Squared error that is worth one bit, in steps squared (default 0.12); more saves\n"
                    "bits, 0 takes the nearest codeword")
        ->check(CLI::Range(0.0, 1000.0));
    command
        .add_option("--keyint", options.key_interval,
                    "Most frames from one I-frame to the next (default 30); 1: I-frames only")
        ->check(CLI::Range(1, 1000000));
    add_choice_options(command, options);
    command
        .add_option("--intra", options.intra,
                    "Coder of the I-frames: tfan (default; keeps every triangle) or draco (drops isolated\n"
                    "vertices, splits non-manifold ones)")
        ->check(CLI::IsMember({"tfan", "draco"}));
    command
        .add_option(
            "--profile", options.profile,
            "tracked (default): the fewest bits. Each frame is the last I-frame's mesh laid on the frame's surface\n"
            "(T-frames), with or without a skeleton; connectivity and sampling are not the capture's. topology:\n"
            "keeps every frame's own connectivity, for several times the bits; paper: the same by the published\n"
            "method's own choices (--reference bone, --registration point, --weights 0). Options marked\n"
            "topology serve both of these")
        ->check(CLI::IsMember({"topology", "paper", "tracked"}));
    command
        .add_option("--reference", options.reference,
                    "topology: reference vertex of a residual: any, the nearest of the predicted mesh, or bone, the "
                    "nearest of\n"
                    "the same bone (default: by profile)")
        ->check(CLI::IsMember({"any", "bone"}));
    command
        .add_option(
            "--registration", options.registration,
            "topology: of the bones, by distances from point to plane, or from point to point (default: by profile)")
        ->check(CLI::IsMember({"plane", "point"}));
    command
        .add_option(
            "--weights", options.weight_width,
            "topology: width in mm of the borders between bones, over which their motions blend; 0: none, each vertex\n"
            "moves with one bone (default: by profile)")
        ->check(CLI::Range(0.0, 1000.0));
    command
        .add_option("--simplify", options.simplify,
                    "tracked: how far the I-frames' meshes may be simplified, which the T-frames take over: error of\n"
                    "their surface, in steps of the positions (default 0.4); 0: I-frames keep every vertex")
        ->check(CLI::Range(0.0, 10.0));
    command
        .add_option("--tracked-from", options.tracked_references,
                    "tracked: previous (default), T-frames refer to the frame before; intra: to the I-frame\n"
                    "alone, so that any of them may be lost, for a few more bits")
        ->check(CLI::IsMember({"previous", "intra"}));
    command
        .add_option("--node-spacing", options.node_spacing,
                    "tracked: mm between the nodes that move the mesh (default 80)")
        ->check(CLI::Range(1.0, 10000.0));
    command.add_flag(
        "--keep-duplicates", options.keep_duplicates,
        "topology: keep vertices that decode to the same point and attributes, and triangles that collapse: the\n"
        "decoded triangle set is then exactly the input's");
    command
        .add_option("--nearest", options.nearest_vertices,
                    "topology: nearest vertices that the distance order counts (default 16)")
        ->check(CLI::Range(1, 64));
    command.add_option("--radii", options.radii_file,
                       "Bone radii from htvm calibrate (default: the skeleton file's,\n"
                       "else calibrated on the first frame)");
    command.add_option("--threads", options.threads, "Threads (default: one a core); the bytes do not depend on it");
}

void check_profile(const CLI::App& command, const EncodingOptions& options) {
    const bool tracked = options.profile == "tracked";
    const std::vector<const char*> others =
        tracked ? std::vector<const char*>{"--decide",          "--predicted-below", "--intra-above",  "--still-below",
                                           "--animation-error", "--reference",       "--registration", "--weights",
                                           "--keep-duplicates", "--nearest"}
                : std::vector<const char*>{"--simplify", "--tracked-from", "--node-spacing"};
    for (const char* name : others)
        if (command.count(name) > 0)
            throw CLI::ValidationError(fmt::format("{} does nothing with --profile {}: add --profile {}", name,
                                                   options.profile, tracked ? "topology" : "tracked"));
}

Result<EncoderOptions> encoder_options(const EncodingOptions& options, const Capture& capture) {
    EncoderOptions out;
    const auto steps = quality_steps(options.quality);
    out.geometry_step = options.geometry_step > 0 ? options.geometry_step : steps.geometry_step;
    out.colour_step = options.colour_step > 0 ? options.colour_step : steps.colour_step;
    out.rate.bits_per_second = 1e6 * options.megabits;
    out.rate.buffer_seconds = options.buffer_seconds;
    out.rate.target_error = options.target_error;
    if (options.lambda >= 0) out.lambda = options.lambda;
    out.key_interval = options.key_interval;
    out.least_key_interval = std::min(options.least_key_interval, options.key_interval);
    if (!options.decide.empty()) out.topology.frame_choice = frame_choice(options.decide);
    if (options.predicted_below >= 0) out.topology.predicted_below = options.predicted_below;
    if (options.intra_above >= 0) out.topology.intra_above = options.intra_above;
    if (options.still_below >= 0) out.topology.still_below = options.still_below;
    if (options.animation_error >= 0) out.topology.animation_error = options.animation_error;
    out.topology.scene_changes = !options.no_scene_changes;
    out.profile = options.profile == "tracked" ? Profile::tracked : Profile::topology;
    if (options.tracked_references == "intra") out.tracked.references = TrackedReferences::intra;
    if (options.simplify >= 0) out.tracked.simplify = options.simplify;
    if (options.node_spacing > 0) out.tracked.node_spacing = options.node_spacing;
    out.topology.merge_duplicates = !options.keep_duplicates;
    out.topology.nearest_vertices = options.nearest_vertices;
    const bool paper = options.profile == "paper";
    const auto chosen = [](const std::string& given, const char* by_profile) {
        return given.empty() ? std::string(by_profile) : given;
    };
    out.topology.reference_vertices =
        chosen(options.reference, paper ? "bone" : "any") == "bone" ? ReferenceVertices::bone : ReferenceVertices::any;
    out.topology.point_to_plane = chosen(options.registration, paper ? "point" : "plane") == "plane";
    if (paper) out.topology.weight_width = 0;
    if (options.weight_width >= 0) out.topology.weight_width = options.weight_width;
    out.threads = options.threads;
    out.fps_numerator = static_cast<std::uint32_t>(std::lround(capture.fps() * 1000));
    out.fps_denominator = 1000;
    out.unit_micrometres = static_cast<std::uint32_t>(std::lround(capture.millimetres_per_unit() * 1000));
    out.skeleton = capture.skeleton();
    out.radii = capture.radii();
    if (!options.radii_file.empty()) {
        if (capture.skeleton().bones.empty())
            return fail(ErrorKind::bad_input, "--radii needs a skeleton (see --skeleton)");
        auto radii = read_radii(options.radii_file, capture.skeleton().bones.size());
        if (!radii) return tl::unexpected(radii.error());
        out.radii = std::move(*radii);
    }
    if (out.radii.empty() && !out.skeleton.bones.empty())
        note("bone radii are calibrated on the first frame; a T-pose suits best (see htvm calibrate)");
    if (options.intra == "draco") out.intra_coder = draco_intra_coder();
    return out;
}

}  // namespace htvm::app
