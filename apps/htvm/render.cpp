// htvm render: a video of a stream or a capture, with a camera that goes round.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/thread.h"
#include "htvm/running_time.hpp"
#include "picture_options.h"
#include "sequences.h"
#include "video_output.h"

namespace htvm::app {
namespace {

struct Options {
    VideoOptions video;
    PictureOptions picture;
    double turns = 1, seconds = 0;  // seconds: 0: as long as the frames last
    std::size_t frames = 0;         // of the input, at most; 0: all
    bool still_camera = false, json = false;
};

constexpr double seconds_of_one_mesh = 6;

Result<MeshSource> open_source(const Options& options) {
    auto source = open_meshes(options.picture.inputs, {{}, "", options.picture.limits, options.picture.texture});
    if (!source) return source;
    if (options.frames > 0) source->frames = std::min(source->frames, options.frames);
    if (source->frames == 0) return fail(ErrorKind::bad_input, source->name + " has no frames");
    return source;
}

// When each frame begins, seconds, and at the end when the last one ends.
std::vector<double> begins_of(const MeshSource& source, const FrameRate& rate) {
    std::vector<double> out;
    for (std::size_t k = 0; k < source.frames; ++k)
        out.push_back(source.times_us.empty() ? static_cast<double>(k) / rate.per_second()
                                              : static_cast<double>(source.times_us[k] - source.times_us[0]) / 1e6);
    const double one = 1 / rate.per_second();
    out.push_back(source.times_us.empty()
                      ? static_cast<double>(source.frames) * one
                      : seconds_of_frames(source.times_us[0], source.times_us[source.frames - 1], source.frames, one));
    return out;
}

// The frame that each picture shows, by its position; where the frames end before the video, they begin again.
std::vector<std::size_t> frames_shown(const std::vector<double>& begins, double seconds, const FrameRate& rate) {
    const auto pictures = static_cast<std::size_t>(std::max(std::llround(seconds * rate.per_second()), 1LL));
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < pictures; ++k) {
        // A little later, as times are rounded to microseconds.
        const double time = std::fmod((static_cast<double>(k) + 0.01) / rate.per_second(), begins.back());
        const auto after = std::upper_bound(begins.begin(), begins.end() - 1, time);
        out.push_back(static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - begins.begin(), 1) - 1));
    }
    return out;
}

// All frames lie within it.
Result<Box> box_of(const Options& options, MeshSource& source) {
    if (source.bounds && options.frames == 0) {
        const auto& [low, high] = *source.bounds;
        return Box{to_point(low), to_point(high), false};
    }
    Box box;
    Progress progress("measuring", source.frames);
    for (std::size_t k = 0; k < source.frames; ++k) {
        if (interruption() != 0) break;
        const auto mesh = source.mesh_at(source, k);
        if (!mesh) return tl::unexpected(mesh.error());
        if (const auto ok = check_measurable(mesh->mesh, source.name); !ok) return tl::unexpected(ok.error());
        extend(box, bounding_box(mesh->mesh));
        progress.step();
    }
    return box;
}

// The frames of a source in order, and from the first one again.
class Frames {
public:
    explicit Frames(const Options& options) : options_(options) {}
    Result<const TexturedMesh*> at(std::size_t position) {
        if (source_ && position == position_) return &mesh_;
        if (!source_ || position < position_) {
            auto opened = open_source(options_);
            if (!opened) return tl::unexpected(opened.error());
            source_ = std::move(*opened);
        }
        auto mesh = source_->mesh_at(*source_, position);
        if (!mesh) return tl::unexpected(mesh.error());
        if (const auto ok = check_measurable(mesh->mesh, source_->name); !ok) return tl::unexpected(ok.error());
        mesh_ = std::move(*mesh);
        position_ = position;
        return &mesh_;
    }

private:
    const Options& options_;
    std::optional<MeshSource> source_;
    std::size_t position_ = 0;
    TexturedMesh mesh_;
};

// A camera that looks at the whole box from where it is at each picture.
struct Orbit {
    Box box;
    ViewOptions views;
    double turns = 1;
    double zoom = 1;
    Result<Camera> at(std::size_t picture, std::size_t pictures) const {
        ViewOptions view = views;
        view.first_azimuth += 360 * turns * static_cast<double>(picture) / static_cast<double>(pictures);
        auto cameras = cameras_round(box, view);
        if (!cameras) return tl::unexpected(cameras.error());
        cameras->front().scale *= zoom;
        return cameras->front();
    }
};

// How much larger the pictures may be drawn: the corners of the box, which the camera has in view, are mostly empty.
Result<double> largest_zoom(Frames& frames, const std::vector<std::size_t>& shown, const Orbit& orbit) {
    std::optional<double> out;
    Progress progress("measuring", shown.size());
    for (std::size_t k = 0; k < shown.size(); ++k) {
        if (interruption() != 0) break;
        const auto mesh = frames.at(shown[k]);
        if (!mesh) return tl::unexpected(mesh.error());
        const auto camera = orbit.at(k, shown.size());
        if (!camera) return tl::unexpected(camera.error());
        if ((*mesh)->mesh.positions.empty()) continue;
        const double zoom = zoomed_to((*mesh)->mesh, *camera, orbit.views.margin).scale / camera->scale;
        out = std::min(out.value_or(zoom), zoom);
        progress.step();
    }
    return out.value_or(1);
}

Result<void> render_all(const Options& options, Frames& frames, const std::vector<std::size_t>& shown,
                        const Orbit& orbit) {
    auto video = VideoOutput::open(options.video);
    if (!video) return tl::unexpected(video.error());
    const internal::ThreadPool pool(options.picture.threads);
    Canvas canvas;
    Progress progress("rendering", shown.size());
    for (std::size_t k = 0; k < shown.size(); ++k) {
        if (interruption() != 0) return fail(ErrorKind::bad_input, "interrupted; no video was written");
        const auto mesh = frames.at(shown[k]);
        if (!mesh) return tl::unexpected(mesh.error());
        const auto camera = orbit.at(k, shown.size());
        if (!camera) return tl::unexpected(camera.error());
        const auto drawable = make_drawable(**mesh, render_options(options.picture, **mesh));
        const auto picture = draw_smoothly(drawable, closer(*camera, orbit.box, options.picture),
                                           samples_of(options.picture), canvas, pool.threads());
        if (auto ok = video->write(picture); !ok) return ok;
        progress.step();
    }
    return video->finish();
}

Result<void> render(Options options) {
    options.picture.texture.ffmpeg = options.video.ffmpeg;
    watch_for_interruption();
    auto source = open_source(options);
    if (!source) return tl::unexpected(source.error());
    auto& video = options.video;
    video.width = options.picture.views.width;
    video.height = options.picture.views.height;
    video.background = options.picture.background;
    const FrameRate rate = source->rate.numerator > 0 ? source->rate : FrameRate{30, 1};
    if (video.rate.numerator == 0) video.rate = rate;
    const auto begins = begins_of(*source, rate);
    double seconds = options.seconds;
    if (seconds == 0) seconds = source->frames == 1 ? seconds_of_one_mesh : begins.back();
    const auto shown = frames_shown(begins, seconds, video.rate);
    const auto box = box_of(options, *source);
    if (!box) return tl::unexpected(box.error());
    Frames frames(options);
    const auto first = frames.at(0);
    if (!first) return tl::unexpected(first.error());
    Orbit orbit{*box, subject_views(options.picture, *source, (*first)->mesh), options.still_camera ? 0 : options.turns,
                1};
    const auto zoom = largest_zoom(frames, shown, orbit);
    if (!zoom) return tl::unexpected(zoom.error());
    orbit.zoom = *zoom;
    if (auto ok = render_all(options, frames, shown, orbit); !ok) return ok;
    if (options.json)
        fmt::print("{}\n", nlohmann::json{{"file", video.path},
                                          {"pictures", shown.size()},
                                          {"seconds", static_cast<double>(shown.size()) / video.rate.per_second()},
                                          {"frames_per_second", video.rate.per_second()},
                                          {"width", video.width},
                                          {"height", video.height}}
                               .dump(2));
    else
        note(fmt::format("{}: {}, {} x {} pixels, {:.4g} a second", video.path, counted(shown.size(), "picture"),
                         video.width, video.height, video.rate.per_second()));
    return {};
}

}  // namespace

void add_render(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    auto* command = app.add_subcommand("render", "Make a video of a stream or a capture, with the camera going round");
    add_picture_input(*command, o.picture);
    command
        ->add_option("-o,--output", o.video.path,
                     "A video (.mp4, .mov, .mkv, .webm, .gif), which ffmpeg makes; or a folder or a pattern such as\n"
                     "out/%05d.png for PNG files, which need no ffmpeg")
        ->type_name("FILE")
        ->required();
    command->add_option("--turns", o.turns, "How often the camera goes round; below 0: the other way")
        ->check(CLI::Range(-1000.0, 1000.0))
        ->capture_default_str();
    command->add_flag("--still-camera", o.still_camera, "The camera stands still");
    command
        ->add_option("--seconds", o.seconds,
                     "How long the video is (default: as long as the frames last; 6 s for a single mesh); where they\n"
                     "end earlier, they begin again")
        ->check(CLI::Range(0.001, 36000.0));
    command->add_option("--frames", o.frames, "Use at most this many frames (default: all)");
    command
        ->add_option_function<std::string>(
            "--fps",
            [&o](const std::string& text) {
                const auto rate = parse_frame_rate(text);
                if (!rate) throw CLI::ValidationError("--fps", rate.error().message);
                o.video.rate = *rate;
            },
            "Pictures per second (default: the stream's frame rate; 30 for files)")
        ->type_name("RATE");
    o.picture.views.width = 1080;
    o.picture.views.height = 1080;
    add_picture_options(*command, o.picture);
    command->add_option("--ffmpeg", o.video.ffmpeg, "The ffmpeg program (default: ffmpeg, found as the shell does)")
        ->type_name("FILE");
    command->add_flag("--json", o.json, "Print what was made as JSON on standard output");
    command->footer(
        "The camera keeps the distance and the zoom at which every frame is whole in its picture.\n"
        "The frames of captures without times are taken for 30 a second.\n"
        "Examples:\n"
        "  htvm render person.htvm -o turntable.mp4\n"
        "  htvm render person.htvm --still-camera --width 1920 -o front.mp4\n"
        "  htvm render capture/ --turns 2 --seconds 12 --background transparent -o 'pictures/%05d.png'");
    command->callback([options, &run] { run = [options] { return render(*options); }; });
}

}  // namespace htvm::app
