#include "picture_options.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "command_line/capture.h"
#include "command_line/choice.h"
#include "command_line/terminal.h"
#include "metrics/front.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

constexpr std::array shadings = {Choice<Shading>{"flat", Shading::flat}, Choice<Shading>{"smooth", Shading::smooth},
                                 Choice<Shading>{"unlit", Shading::unlit}};
const std::map<std::string, Colour> named_colours{
    {"white", {255, 255, 255}}, {"black", {0, 0, 0}}, {"grey", {128, 128, 128}}};

constexpr int largest_canvas = 16384;  // pixels, as cameras_round() allows

// "transparent", a name, or six hexadecimal digits.
std::optional<Colour> parse_background(const std::string& text) {
    if (text == "transparent") return std::nullopt;
    if (const auto named = named_colours.find(text); named != named_colours.end()) return named->second;
    const std::string digits = text.starts_with('#') ? text.substr(1) : text;
    if (digits.size() != 6 || digits.find_first_not_of("0123456789abcdefABCDEF") != digits.npos)
        throw CLI::ValidationError("--background",
                                   "'" + text + "' is not a colour; write transparent, white, black, grey or #rrggbb");
    const auto value = std::stoul(digits, nullptr, 16);
    return Colour{static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 8),
                  static_cast<std::uint8_t>(value)};
}

}  // namespace

void add_camera_options(CLI::App& command, ViewOptions& views, const std::string& up_default) {
    command.add_option("--width", views.width, "Width of the pictures, pixels")->capture_default_str();
    command.add_option("--height", views.height, "Height of the pictures, pixels")->capture_default_str();
    add_choice(command, "--up", views.up, up_axes, "Where the head is" + up_default)
        ->default_str(word_of(views.up, up_axes));
    command.add_option("--azimuth", views.first_azimuth, "Direction of the first view, degrees around the body")
        ->capture_default_str();
    command.add_option("--elevation", views.elevation, "Degrees by which the views look down")->capture_default_str();
    command.add_flag("--orthographic", views.orthographic, "Parallel projection instead of perspective");
}

void add_shading_options(CLI::App& command, ShadingOptions& options, const std::string& shading_default) {
    add_choice(command, "--shading", options.shading, shadings,
               "Shading of the body; unlit draws the colours alone" + shading_default)
        ->default_str(shading_default.empty() ? "smooth" : "");
    command.add_flag("--grey", options.grey, "Draw without the colours");
}

void add_picture_input(CLI::App& command, PictureOptions& options) {
    command
        .add_option("input", options.inputs,
                    "An .htvm stream; or a mesh file, several in their order, a folder, glob or %05d pattern")
        ->type_name("FILE")
        ->expected(1, -1)
        ->required();
}

void add_picture_options(CLI::App& command, PictureOptions& options) {
    options.views.views = 1;
    options.views.elevation = 5;
    options.views.up = UpAxis::unknown;
    add_camera_options(command, options.views,
                       " (default: as the stream says; else y or z, along which the first mesh is longer)");
    command
        .add_option("--field-of-view", options.views.field_of_view,
                    "Degrees from the upper to the lower edge: a small angle looks flat, a wide one near")
        ->capture_default_str();
    command.add_option("--zoom", options.zoom, "How many times as large as where the whole is in the picture")
        ->check(CLI::Range(0.01, 1000.0))
        ->capture_default_str();
    command
        .add_option_function<std::vector<double>>(
            "--look-at",
            [&options](const std::vector<double>& place) {
                for (const double c : place)
                    if (!std::isfinite(c)) throw CLI::ValidationError("--look-at", "is three numbers, X,Y,Z");
                options.look_at = {place[0], place[1], place[2]};
            },
            "What is in the middle of the picture, mm in the stream's coordinates (default: the middle of the box)")
        ->delimiter(',')
        ->expected(3)
        ->type_name("X,Y,Z");
    add_shading_options(command, options.shading,
                        " (default: unlit, as captured, or smooth where there are no colours)");
    command
        .add_option_function<std::string>(
            "--background", [&options](const std::string& text) { options.background = parse_background(text); },
            "transparent, white (default), black, grey, or #rrggbb")
        ->type_name("COLOUR");
    command
        .add_option("--samples", options.samples,
                    "Samples across a pixel, whose square are averaged for soft edges; 1: hard edges, faster")
        ->check(CLI::Range(1, 16))
        ->capture_default_str();
    command.add_option("--threads", options.threads,
                       "Threads to use (default: one per core); the pictures do not depend on it");
    add_texture_options(command, options.texture);
    add_decoder_limits(command, options.limits);
}

RenderOptions render_options(const PictureOptions& options, const TexturedMesh& mesh) {
    RenderOptions out;
    out.colours = !options.shading.grey;
    const bool coloured = out.colours && ShownMesh(mesh).has_colours();
    out.shading = options.shading.shading.value_or(coloured ? Shading::unlit : Shading::smooth);
    return out;
}

UpAxis likely_up(const Mesh& first) {
    const Box box = bounding_box(first);
    const Point3 extent = box.high - box.low;
    return extent[2] > extent[1] ? UpAxis::plus_z : UpAxis::plus_y;
}

ViewOptions subject_views(const PictureOptions& options, const MeshSource& source, const Mesh& first) {
    ViewOptions out = options.views;
    if (out.up == UpAxis::unknown) out.up = source.up;
    if (out.up == UpAxis::unknown) {
        out.up = likely_up(first);
        if (out.up == UpAxis::plus_z)
            note("the first mesh is longer along z than along y: z is taken for up (see --up)");
    }
    if (const auto front = source.front ? source.front : facing_of(first))
        out.first_azimuth += azimuth_of(*front, out.up).value_or(0);
    return out;
}

Camera closer(const Camera& camera, const Box& box, const PictureOptions& options) {
    Camera out = camera;
    out.scale *= options.zoom;
    if (options.look_at) out.position = out.position + *options.look_at - (box.low + box.high) * 0.5;
    return out;
}

int samples_of(const PictureOptions& options) {
    const int size = std::max({options.views.width, options.views.height, 1});
    return std::clamp(largest_canvas / size, 1, options.samples);
}

}  // namespace htvm::app
