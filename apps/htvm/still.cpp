// htvm still: a picture of one frame.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line/terminal.h"
#include "commands.h"
#include "core/thread.h"
#include "io/output_file.h"
#include "picture_options.h"
#include "sequences.h"

namespace htvm::app {
namespace {

struct Options {
    std::string output;
    std::optional<std::uint64_t> frame;
    std::optional<double> seconds;
    PictureOptions picture;
    bool json = false;
};

// The position of the frame asked for; without one, the middle of the sequence: the first one is often a T-pose.
Result<std::size_t> position_of(const Options& options, const MeshSource& source) {
    const auto& numbers = source.numbers;
    const auto& times = source.times_us;
    const auto last = source.frames - 1;
    if (options.frame) {
        const auto found = std::lower_bound(numbers.begin(), numbers.end(), *options.frame);
        const bool there =
            numbers.empty() ? *options.frame <= last : found != numbers.end() && *found == *options.frame;
        if (!there)
            return fail(ErrorKind::bad_input,
                        fmt::format("{} has no frame {}; its frames are {} to {}", source.name, *options.frame,
                                    numbers.empty() ? 0 : numbers.front(), numbers.empty() ? last : numbers.back()));
        return numbers.empty() ? static_cast<std::size_t>(*options.frame)
                               : static_cast<std::size_t>(found - numbers.begin());
    }
    if (!options.seconds) return source.frames / 2;
    if (times.empty()) {
        const double per_second = source.rate.numerator > 0 ? source.rate.per_second() : 30;
        return std::min(last, static_cast<std::size_t>(*options.seconds * per_second + 1e-6));
    }
    const auto seconds = [&](std::int64_t time) { return static_cast<double>(time - times.front()) / 1e6; };
    const auto after = std::upper_bound(times.begin(), times.end(), *options.seconds + 1e-6,
                                        [&](double asked, std::int64_t time) { return asked < seconds(time); });
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - times.begin(), 1) - 1);
}

// Whether the time asked for is more than a tenth of a second behind the last frame.
bool is_beyond(const Options& options, const MeshSource& source) {
    constexpr double shown = 0.1;  // a frame is, until the next would come
    if (!options.seconds) return false;
    const double last =
        source.times_us.empty()
            ? static_cast<double>(source.frames - 1) / (source.rate.numerator > 0 ? source.rate.per_second() : 30)
            : static_cast<double>(source.times_us.back() - source.times_us.front()) / 1e6;
    return *options.seconds > last + shown;
}

Result<void> still(const Options& options) {
    if (options.output != "-" && !options.output.ends_with(".png"))
        return fail(ErrorKind::unsupported, "pictures are written as .png, not as " + options.output);
    auto source = open_meshes(options.picture.inputs, {{}, "", options.picture.limits, options.picture.texture});
    if (!source) return tl::unexpected(source.error());
    if (source->frames == 0) return fail(ErrorKind::bad_input, source->name + " has no frames");
    const auto position = position_of(options, *source);
    if (!position) return tl::unexpected(position.error());
    // Which way is up, and where the front is, where nothing says it, is judged by the first frame, so that every
    // frame's picture is alike.
    auto first = source->mesh_at(*source, 0);
    const auto textured = *position == 0 ? first : source->mesh_at(*source, *position);
    if (!textured) return tl::unexpected(textured.error());
    const Mesh* mesh = &textured->mesh;
    if (const auto ok = check_measurable(*mesh, source->name); !ok) return ok;
    const Box box = bounding_box(*mesh);
    const auto cameras = cameras_round(box, subject_views(options.picture, *source, first ? first->mesh : *mesh));
    if (!cameras) return tl::unexpected(cameras.error());
    const internal::ThreadPool pool(options.picture.threads);
    Canvas canvas;
    const auto camera = closer(zoomed_to(*mesh, cameras->front(), options.picture.views.margin), box, options.picture);
    const auto picture = draw_smoothly(make_drawable(*textured, render_options(options.picture, *textured)), camera,
                                       samples_of(options.picture), canvas, pool.threads());
    const auto png = png_of(picture, options.picture.background);
    if (!png) return tl::unexpected(png.error());
    const auto written = options.output == "-" ? write_standard_output(*png) : write_file(options.output, *png);
    if (!written) return written;
    const auto number = source->numbers.empty() ? *position : source->numbers[*position];
    if (mesh->triangles.empty()) warn(fmt::format("frame {} has no triangles: the picture is empty", number));
    if (options.json)
        fmt::print("{}\n", nlohmann::json{{"file", options.output},
                                          {"frame", number},
                                          {"width", picture.width},
                                          {"height", picture.height},
                                          {"vertices", mesh->positions.size()},
                                          {"triangles", mesh->triangles.size()}}
                               .dump(2));
    else if (options.output != "-")
        note(fmt::format("{}: frame {} of {}{}, {} x {} pixels", options.output, number, source->name,
                         is_beyond(options, *source) ? ", its last, as it ends before that time" : "", picture.width,
                         picture.height));
    return {};
}

}  // namespace

void add_still(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    auto* command = app.add_subcommand("still", "Draw one frame of a stream or a capture as a picture");
    add_picture_input(*command, o.picture);
    command->add_option("-o,--output", o.output, "The picture, a .png file, or - for standard output")
        ->type_name("FILE")
        ->required();
    auto* frame = command->add_option(
        "--frame", o.frame,
        "Which frame, by its number: in a stream from 0, of files as in their names (default: the middle one)");
    command->add_option("--time", o.seconds, "Which frame: the one shown at this time, seconds from the first one")
        ->check(CLI::NonNegativeNumber)
        ->excludes(frame);
    o.picture.views.width = 1600;
    o.picture.views.height = 1200;
    add_picture_options(*command, o.picture);
    command->add_flag("--json", o.json, "Print what was drawn as JSON on standard output");
    command->footer(
        "The frame fills the picture, whichever way the camera looks. The page of 'htvm serve' shows NAME.png as\n"
        "the still of NAME.htvm if it lies beside it.\n"
        "Examples:\n"
        "  htvm still person.htvm -o person.png\n"
        "  htvm still capture/ --time 2.5 --azimuth 30 --background transparent -o poster.png\n"
        "  htvm still person.htvm --zoom 4 --look-at 0,1600,80 -o face.png");
    command->callback([options, &run] {
        if (options->output == "-" && options->json)
            throw CLI::ValidationError("--json", "prints on standard output, where -o - puts the picture; choose one");
        run = [options] { return still(*options); };
    });
}

}  // namespace htvm::app
