// htvm synth: a synthetic capture of a person, as mesh files and a skeleton, or as a camera would send it.
#include "synth/synth.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "command_line/choice.h"
#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/parallel.h"
#include "io/image_file.h"
#include "io/mesh_file.h"
#include "io/output_file.h"
#include "io/ply.h"
#include "io/skeleton_file.h"
#include "io/timestamps.h"
#include "pacing.h"
#include "synth/depth_cameras.h"
#include "synth/texture.h"
#include "synth_truth.h"
#include "texture_output.h"
#include "used_folder.h"

namespace htvm::app {

using namespace internal;
namespace {

constexpr int most_frames = 1000000;

struct Options {
    std::string folder, truth;  // truth: empty for none
    int frames = 60, first_frame = 0, marks = 1000;
    SynthOptions synth;
    SynthTextureOptions texture;
    DepthCameraOptions cameras;
    bool is_textured = false, has_cameras = false;
    ImageFormat texture_format = ImageFormat::jpeg;
    unsigned threads = 0;
    bool json = false, live = false, counted = false;  // counted: the number of frames was given
};

struct Written {
    std::set<std::string> names;
    std::size_t vertices = 0, triangles = 0;
    double seconds = 0;
};

std::filesystem::path frame_path(const Options& options, int frame) {
    return std::filesystem::path(options.folder) / fmt::format("frame_{:05}.ply", frame);
}

const char* extension_of(ImageFormat format) { return format == ImageFormat::png ? ".png" : ".jpg"; }

// The image beside a mesh.
Result<void> write_image(const Options& options, std::filesystem::path path, const Image& image) {
    path.replace_extension(extension_of(options.texture_format));
    const auto bytes = options.texture_format == ImageFormat::png ? write_png_image(image) : write_jpeg_image(image);
    if (!bytes) return tl::unexpected(bytes.error());
    return write_file(path, *bytes);
}

// A frame's mesh; its texture beside, if it has one.
Result<void> write_frame(const Options& options, const std::filesystem::path& path, const Mesh& mesh,
                         const std::optional<SynthTexture>& texture) {
    if (!texture) return write_mesh(path, mesh);
    MeshFileOptions named;
    named.texture = path.stem().string() + extension_of(options.texture_format);
    if (auto ok = write_image(options, path, texture->image); !ok) return ok;
    return write_mesh(path, mesh, named);
}

SkeletonTrack empty_track(double fps) {
    SkeletonTrack track;
    track.skeleton = synth_skeleton();
    track.fps = fps;
    return track;
}

void add_pose(SkeletonTrack& track, Pose pose) {
    track.timestamps.push_back(static_cast<double>(track.poses.size()) / track.fps);
    track.poses.push_back(std::move(pose));
}

// Generates as many frames at once as there are threads, so that memory does not grow with the number of frames.
Result<Written> write_frames(const Options& options, SkeletonTrack& noisy, SkeletonTrack& exact, TruthFiles* truth) {
    const ThreadPool pool(std::min(thread_count(options.threads), 64u));
    const Threads threads = pool.threads();
    Written written;
    Progress progress("synth", static_cast<std::size_t>(options.frames));
    for (int done = 0; done < options.frames;) {
        const int count = std::min(static_cast<int>(threads.count), options.frames - done);
        std::vector<SynthFrame> made(static_cast<std::size_t>(count));
        std::vector<TrueFrame> known(made.size());
        std::vector<std::optional<SynthTexture>> textures(made.size());
        std::vector<std::optional<DepthCapture>> captures(made.size());
        const Threads inner = threads.at_most(std::max(1u, threads.count / static_cast<unsigned>(count)));
        parallel_for(made.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const int number = options.first_frame + done + static_cast<int>(i);
                made[i] = synth_frame(options.synth, number, inner);
                if (options.is_textured)
                    textures[i] = synth_texture(options.synth, options.texture, made[i], number, inner);
                if (options.has_cameras)
                    captures[i] = capture_depth(options.synth, options.cameras, made[i], number, inner);
                if (truth) known[i] = true_frame(options.synth, truth->marks(), number, inner);
            }
        });
        for (std::size_t i = 0; i < made.size(); ++i) {
            SynthFrame& frame = made[i];
            const auto path = frame_path(options, options.first_frame + done++);
            const Mesh& shown = captures[i] ? captures[i]->mesh : textures[i] ? textures[i]->mesh : frame.mesh;
            if (auto ok = write_frame(options, path, shown, textures[i]); !ok) return tl::unexpected(ok.error());
            written.names.insert(path.filename().string());
            if (textures[i]) written.names.insert(path.stem().string() + extension_of(options.texture_format));
            written.vertices += shown.positions.size();
            written.triangles += shown.triangles.size();
            add_pose(noisy, std::move(frame.pose));
            add_pose(exact, std::move(frame.true_pose));
            if (truth)
                if (auto ok = truth->add(path.filename().string(), std::move(frame), std::move(known[i]),
                                         textures[i] ? &*textures[i] : nullptr, captures[i] ? &*captures[i] : nullptr);
                    !ok)
                    return tl::unexpected(ok.error());
            progress.step();
        }
    }
    return written;
}

void report(const Options& options, const Written& written) {
    const auto frames = static_cast<double>(options.frames);
    note(fmt::format(
        "{} ({:.0f} vertices each on average), skeleton.json and skeleton_true.json to {}, made at "
        "{:.1f} frames/s",
        counted(static_cast<std::size_t>(options.frames), "frame"), static_cast<double>(written.vertices) / frames,
        options.folder, frames / std::max(written.seconds, 1e-9)));
    if (!options.json) return;
    const std::filesystem::path folder(options.folder);
    nlohmann::json summary = {{"folder", options.folder},
                              {"frames", options.frames},
                              {"first_frame", options.first_frame},
                              {"fps", options.synth.fps},
                              {"seed", options.synth.seed},
                              {"vertices", written.vertices},
                              {"triangles", written.triangles},
                              {"first_mesh", frame_path(options, options.first_frame).string()},
                              {"skeleton", (folder / "skeleton.json").string()},
                              {"true_skeleton", (folder / "skeleton_true.json").string()},
                              {"seconds", written.seconds}};
    if (options.has_cameras) {
        summary["cameras"] = options.cameras.cameras;
        summary["sensor"] = sensor_name(options.cameras.sensor);
        summary["camera_distance_mm"] = camera_distance(options.synth, options.cameras);
    }
    fmt::print("{}\n", summary.dump(2));
}

Result<void> synthesise(const Options& options) {
    if (auto ok = check_synth_options(options.synth); !ok) return ok;
    if (auto ok = check_texture_options(options.texture); !ok) return ok;
    if (auto ok = check_depth_cameras(options.cameras); !ok) return ok;
    const auto start = std::chrono::steady_clock::now();
    std::error_code error;
    std::filesystem::create_directories(options.folder, error);
    if (error) return fail(ErrorKind::bad_input, options.folder + " cannot be made: " + error.message());
    SkeletonTrack noisy = empty_track(options.synth.fps), exact = noisy;
    std::optional<TruthFiles> truth;
    if (!options.truth.empty()) {
        auto made = TruthFiles::create(options.truth, options.synth, options.first_frame, options.marks,
                                       options.has_cameras ? &options.cameras : nullptr);
        if (!made) return tl::unexpected(made.error());
        truth = std::move(*made);
    }
    auto written = write_frames(options, noisy, exact, truth ? &*truth : nullptr);
    if (!written) return tl::unexpected(written.error());
    if (truth)
        if (auto ok = truth->finish(); !ok) return ok;
    const std::filesystem::path folder(options.folder);
    if (auto ok = write_skeleton((folder / "skeleton.json").string(), noisy); !ok) return ok;
    if (auto ok = write_skeleton((folder / "skeleton_true.json").string(), exact); !ok) return ok;
    written->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    warn_of_other_frames({.folder = options.folder, .prefix = "", .suffix = ""}, false, written->names);
    report(options, *written);
    return {};
}

// ---- As a camera would send it --------------------------------------------------------------------------------------

// A frame each time that one is due. What cannot be made or written in time is left out, as a camera would.
Result<void> synthesise_live(const Options& options) {
    if (auto ok = check_synth_options(options.synth); !ok) return ok;
    if (auto ok = check_depth_cameras(options.cameras); !ok) return ok;
    watch_for_interruption();
    const ThreadPool pool(std::min(thread_count(options.threads), 64u));
    Progress progress("synth", 0);
    using Clock = std::chrono::steady_clock;
    const auto begun = Clock::now();
    const auto due = [&](std::int64_t k) {
        return begun + std::chrono::duration_cast<Clock::duration>(
                           std::chrono::duration<double>(static_cast<double>(k) / options.synth.fps));
    };
    const auto fps = fmt::format("{}", options.synth.fps);
    std::size_t late = 0;
    for (std::int64_t k = 0; !options.counted || k < options.frames; ++k) {
        if (Clock::now() > due(k + 1)) {
            ++late;
            continue;
        }
        const int number = options.first_frame + static_cast<int>(k);
        auto made = synth_frame(options.synth, number, pool.threads());
        if (options.has_cameras)
            made.mesh = capture_depth(options.synth, options.cameras, made, number, pool.threads()).mesh;
        wait_until(due(k));
        if (interruption() != 0) break;
        const auto bytes =
            write_ply(made.mesh, time_text(std::llround(1e6 * static_cast<double>(k) / options.synth.fps)), {}, fps);
        if (!bytes) return tl::unexpected(bytes.error());
        if (auto ok = write_standard_output(*bytes); !ok && interruption() == 0) return ok;
        progress.step(late > 0 ? fmt::format("{} left out, as there was no time for them", late) : "");
    }
    return {};
}

// ---- Options --------------------------------------------------------------------------------------------------------

void add_places(CLI::App& command, Options& o) {
    command
        .add_option("OUT_DIR,-o,--output", o.folder,
                    "Folder to write frame_00000.ply ..., skeleton.json, skeleton_true.json to")
        ->type_name("FOLDER");
    command
        .add_flag("--live", o.live,
                  "Instead, PLY after PLY on standard output, each when it is due, without end, as a\n"
                  "camera would send them: for htvm encode -")
        ->group(heading::output);
    command
        .add_option("--truth", o.truth,
                    "Folder for what no real capture knows: the surface without noise, points fixed on it in every\n"
                    "frame, and when limbs are fast, touch or come off ('htvm compare --truth' reads it)")
        ->type_name("FOLDER")
        ->group(heading::output);
    command.add_option("--truth-marks", o.marks, "How many points of the surface are followed there")
        ->check(CLI::Range(1, 20000))
        ->capture_default_str()
        ->group(heading::output);
}

void add_motion(CLI::App& command, Options& o) {
    command.option_defaults()->group("The motion");
    command.add_option("--frames", o.frames, "How many frames")
        ->check(CLI::Range(1, most_frames))
        ->capture_default_str();
    command.add_option("--first-frame", o.first_frame, "The first frame's number; the motion starts at frame 0")
        ->check(CLI::Range(0, most_frames))
        ->capture_default_str();
    std::map<std::string, SynthMotion> motions;
    for (const auto& [motion, name] : synth_motions) motions[name] = motion;
    command
        .add_option("--motion", o.synth.motion,
                    "What the person does: a tour (default), calm, everyday (walks, sits down, hands in pockets, a\n"
                    "ball; somebody comes in), or fast (dances, kicks, jumps)")
        ->transform(CLI::CheckedTransformer(motions, CLI::ignore_case))
        ->option_text("tour|calm|everyday|fast");
    command.add_option("--people", o.synth.people, "2: a second person moves beside; not in the tour")
        ->check(CLI::Range(1, 2))
        ->capture_default_str();
    command.add_option("--fps", o.synth.fps, "Frames per second")->capture_default_str();
}

void add_capturing(CLI::App& command, Options& o) {
    command.option_defaults()->group("How it is captured");
    command
        .add_option("--vertices", o.synth.vertices,
                    "Vertices per frame, within 3 %; with --cameras in all sheets together, roughly, by their number\n"
                    "of pixels (default: the sensor's own)")
        ->capture_default_str();
    command
        .add_option("--seed", o.synth.seed,
                    "Seed of the noise and the sampling, and of the order of moves (the tour stays the same)")
        ->capture_default_str();
    command
        .add_option("--surface-noise", o.synth.surface_noise_power,
                    "Power of the noise on the surface, mm^2; new in every frame (2.25 is 1.5 mm RMS)")
        ->capture_default_str();
    command
        .add_option("--joint-noise", o.synth.joint_noise_power,
                    "Power of the noise on each joint coordinate in skeleton.json, mm^2 (25 is 5 mm RMS);\n"
                    "skeleton_true.json has none")
        ->capture_default_str();
    command.add_flag("--lattice", o.synth.lattice,
                     "Keep the vertices on the edges of one regular grid (by default there is no grid)");
    command.add_flag("--normals", o.synth.normals, "Write vertex normals too");
}

void add_texture(CLI::App& command, Options& o) {
    command.option_defaults()->group(heading::textures);
    auto* texture = command
                        .add_option("--texture", o.texture.size,
                                    "Write a texture of that many pixels along a side beside every mesh, in place of "
                                    "vertex\ncolours: an atlas whose layout changes every second, with noise and a "
                                    "drifting exposure;\nwith --truth also without these")
                        ->option_text("PIXELS");
    constexpr std::array formats = {Choice<ImageFormat>{"jpg", ImageFormat::jpeg},
                                    Choice<ImageFormat>{"png", ImageFormat::png}};
    add_choice(command, "--texture-format", o.texture_format, formats, "The format of these images")
        ->default_str("jpg")
        ->needs(texture);
    command.add_option("--texture-noise", o.texture.noise, "Their noise, levels RMS; new in every texel and frame")
        ->capture_default_str()
        ->needs(texture);
    command
        .add_option("--texture-exposure", o.texture.exposure,
                    "By how many percent their exposure goes up and down, over seconds")
        ->capture_default_str()
        ->needs(texture);
}

void add_cameras(CLI::App& command, Options& o) {
    command.option_defaults()->group("As depth cameras see it");
    auto* cameras =
        command
            .add_option("--cameras", o.cameras.cameras,
                        "Capture the person with so many depth cameras, evenly spaced around, the first "
                        "one in front: an open\nsheet of triangles from each, with holes, noise and specks; "
                        "with --truth the whole body beside")
            ->check(CLI::Range(1, 16))
            ->option_text("N");
    std::vector<Choice<DepthSensor>> sensors;
    for (const DepthSensor sensor : depth_sensors) sensors.push_back({sensor_name(sensor), sensor});
    add_choice(command, "--sensor", o.cameras.sensor, sensors,
               "What they are: kinect, which stand still some metres away, or phone, held at an arm's\nlength before "
               "head and shoulders")
        ->default_str("kinect")
        ->needs(cameras);
    command
        .add_option("--camera-distance", o.cameras.distance,
                    "How far away they are, mm (default: kinect 2500, or 3000 where people walk about; phone 600)")
        ->check(CLI::Range(300.0, 4000.0))
        ->option_text("MM")
        ->needs(cameras);
    command
        .add_option("--depth-noise", o.cameras.noise,
                    "How much of the sensor's own noise, lost and flying pixels there is; 0: exact cameras")
        ->check(CLI::Range(0.0, 4.0))
        ->capture_default_str()
        ->needs(cameras);
}

// What belongs to the whole surface, and not to what depth cameras make of it.
std::string contradiction_with_cameras(const CLI::App& command) {
    for (const auto& [option, why] :
         {std::pair("--texture", "depth cameras deliver vertex colours"),
          std::pair("--lattice", "depth cameras have a grid of pixels"),
          std::pair("--surface-noise", "depth cameras have their sensor's noise: --depth-noise")})
        if (command.count("--cameras") > 0 && command.count(option) > 0)
            return std::string(option) + ": not with --cameras; " + why;
    return {};
}

std::string contradiction_in(const Options& options) {
    if (options.live == !options.folder.empty())
        return "OUT_DIR: or --live: give one of them, a folder to write to or standard output";
    if (options.folder == "-") return "OUT_DIR: is a folder; for meshes on standard output give --live";
    if (options.live && !options.truth.empty()) return "--truth: goes with a folder of frames, not with --live";
    if (options.live && options.is_textured)
        return "--texture: writes images beside meshes in a folder, so not with --live";
    return {};
}

}  // namespace

void add_synth(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    CLI::App* command = app.add_subcommand("synth", "Make a synthetic capture of a person: meshes and skeleton");
    command->description(
        "Make a synthetic capture of a person, to try the codec on: a dressed, coloured body, 1.75 m tall, that\n"
        "starts in a T-pose, then walks, waves, turns and jumps in a cycle of 8 seconds (--motion has others,\n"
        "which go on without repeating). The surface is meshed anew in every frame, as reconstructions are: the number "
        "and positions of the vertices and the triangles\n"
        "all change.\n"
        "The same options give the same bytes, and every frame can be made on its own (--first-frame).");
    add_places(*command, o);
    add_motion(*command, o);
    add_capturing(*command, o);
    add_cameras(*command, o);
    add_texture(*command, o);
    command->option_defaults()->group("Options");
    command->add_option("--threads", o.threads, "Threads to use (default: one per core); the result is the same")
        ->group(heading::parallel);
    command->add_flag("--json", o.json, "Print what was written as JSON on standard output")
        ->excludes(command->get_option("--live"))
        ->group(heading::scripts);
    command->footer(
        "Example: a capture of 2 seconds, then its stream and what is in it\n"
        "  htvm synth capture --frames 60\n"
        "  htvm encode capture --skeleton capture/skeleton.json -o capture.htvm\n"
        "  htvm info capture.htvm\n"
        "A dancer, and how far the decoded surface slides along the true one\n"
        "  htvm synth dance --motion fast --truth truth\n"
        "  htvm encode dance -o dance.htvm\n"
        "  htvm compare dance dance.htvm --only m2 --truth truth\n"
        "Example: a live stream without a camera, beside a hub (htvm serve)\n"
        "  htvm synth --live --vertices 10000 --fps 10 | htvm encode - -o ws://localhost:8080/publish/me");
    add_front_page(*command, {{{"--frames"},
                               {"--fps"},
                               {"--vertices"},
                               {"--motion"},
                               {"--people"},
                               {"--cameras", "Capture it with so many depth cameras: open sheets with holes and noise"},
                               {"--texture", "Write images of so many pixels along a side, in place of vertex colours"},
                               {"--seed", "Another number makes other noise, and other moves"},
                               {"--truth", "Folder for what no real capture knows: htvm compare --truth reads it"},
                               {"--live", "PLY after PLY on standard output instead, as a camera would send them"},
                               {"--json"}}});
    command->callback([options, command, &run] {
        options->is_textured = command->count("--texture") > 0;
        options->counted = command->count("--frames") > 0;
        options->has_cameras = command->count("--cameras") > 0;
        if (options->has_cameras) {
            options->cameras.vertices = command->count("--vertices") > 0 ? options->synth.vertices : 0;
            options->synth.vertices = body_vertices(options->cameras);
        }
        if (const auto why = contradiction_in(*options); !why.empty()) throw CLI::ValidationError(why);
        if (const auto why = contradiction_with_cameras(*command); !why.empty()) throw CLI::ValidationError(why);
        run = [options] { return options->live ? synthesise_live(*options) : synthesise(*options); };
    });
}

}  // namespace htvm::app
