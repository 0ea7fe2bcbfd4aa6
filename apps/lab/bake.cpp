// htvm-lab bake: the pictures of a textured capture in the layout of a stream's charts, and what the layout and the
// tracking cost before any video coding.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "command_line/capture.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/disjoint_sets.h"
#include "htvm/encoder.hpp"
#include "io/image_file.h"
#include "io/output_file.h"
#include "metrics/compare.h"
#include "sweep.h"
#include "texture/texture_baking.h"

namespace htvm::lab {

using namespace app;
namespace {

struct Options {
    CaptureOptions capture;
    std::string output;
    int size = 0;
    double quality = 50;
    int views = 3, compare_every = 10;
    int width = 1280, height = 1024;  // of the pictures that are compared
    bool json = false;
};

struct BakedFrame {
    FrameInfo info;
    std::size_t charts = 0;
    double share = 0;  // of the picture, that charts cover
    double seen = 0, milliseconds = 0;
    std::array<double, 3> gains{};
    std::optional<double> unlit_db, unlit_ssim;
};

std::size_t charts_of(const Mesh& mesh) {
    internal::DisjointSets sets(mesh.positions.size());
    std::set<std::uint32_t> out;
    for (const auto& [a, b, c] : mesh.triangles) sets.join(a, b), sets.join(b, c);
    for (const auto& t : mesh.triangles) out.insert(sets.of(t[0]));
    return out.size();
}

double share_of(const Mesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto& p = mesh.texcoords;
        sum += std::abs(
            static_cast<double>((p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0])));
    }
    return sum / 2;
}

Result<void> write_bytes(const std::filesystem::path& path, const Result<std::vector<std::uint8_t>>& bytes) {
    if (!bytes) return tl::unexpected(bytes.error());
    return write_file(path.string(), *bytes);
}

// The capture, what the stream shows, and their difference, without shading, from `views` sides.
Result<PictureErrorSums> compare_pictures(const Options& options, std::size_t frame, UpAxis up,
                                          const TexturedMesh& captured, const TexturedMesh& shown) {
    CompareOptions compared;
    compared.points = compared.surface = compared.regions = compared.texcoords = compared.cloud = compared.topology =
        false;
    compared.views.up = up;
    compared.views.views = options.views;
    compared.views.width = options.width;
    compared.views.height = options.height;
    const auto result = compare_frame({captured.mesh, captured}, {shown.mesh, shown}, compared);
    if (!result) return tl::unexpected(result.error());
    if (!options.output.empty()) {
        auto views = compared.views;
        views.width = 640;
        views.height = 1024;
        const auto cameras = cameras_round(result->original_box, views);
        if (!cameras) return tl::unexpected(cameras.error());
        RenderOptions render_options;
        render_options.shading = Shading::unlit;
        std::vector<Picture> pictures;
        for (const auto& camera : *cameras) {
            const auto original = render(captured, camera, render_options);
            const auto decoded = render(shown, camera, render_options);
            pictures.push_back(original);
            pictures.push_back(decoded);
            pictures.push_back(difference_picture(original, decoded));
        }
        const auto name = fmt::format("{}/view_{:05}.png", options.output, frame);
        if (auto ok = write_png(side_by_side(pictures), name); !ok) return tl::unexpected(ok.error());
    }
    return result->unlit_pictures;
}

nlohmann::json json_of(const BakedFrame& frame) {
    nlohmann::json out = {{"frame", frame.info.frame},
                          {"type", kind_of(frame.info.type).letter},
                          {"bytes", frame.info.bytes.total()},
                          {"chart_bytes", frame.info.bytes[Layer::charts]},
                          {"vertices", frame.info.vertices},
                          {"charts", frame.charts},
                          {"picture_share", frame.share},
                          {"seen", frame.seen},
                          {"gains", frame.gains},
                          {"milliseconds", frame.milliseconds}};
    if (frame.unlit_db) out["unlit_db"] = *frame.unlit_db;
    if (frame.unlit_ssim) out["unlit_ssim"] = *frame.unlit_ssim;
    return out;
}

void print(const BakedFrame& f) {
    fmt::print("{:>6} {:>3}{:>9}{:>8}{:>10}{:>8}{:>8.1f} %{:>8.2f} %{:>8.3f}{:>7.3f}{:>7.3f}{:>8.0f}", f.info.frame,
               kind_of(f.info.type).letter, f.info.bytes.total(), f.info.bytes[Layer::charts], f.info.vertices,
               f.charts, 100 * f.share, 100 * f.seen, f.gains[0], f.gains[1], f.gains[2], f.milliseconds);
    if (f.unlit_db) fmt::print("{:>9.2f}{:>8.4f}", *f.unlit_db, *f.unlit_ssim);
    fmt::print("\n");
}

Result<void> bake(const Options& options) {
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    if (!options.output.empty())
        if (auto ok = make_folder(options.output); !ok) return ok;
    std::optional<Encoder> encoder;
    std::optional<TextureBaker> baker;
    std::vector<BakedFrame> frames;
    if (!options.json)
        fmt::print("{:>6} {:>3}{:>9}{:>8}{:>10}{:>8}{:>10}{:>10}{:>22}{:>8}{:>9}{:>8}\n", "frame", "", "bytes",
                   "charts", "vertices", "charts", "picture", "seen", "gains", "ms", "M3 unlit", "SSIM");
    for (std::size_t i = 0;; ++i) {
        auto mesh = capture->next();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) break;
        const auto captured = capture->textured();
        if (!captured) return fail(ErrorKind::bad_input, capture->name() + " has no texture");
        if (!encoder) {
            const int side = options.size > 0 ? options.size : picture_side_for(*captured);
            EncoderOptions settings;
            settings.quality = options.quality;
            settings.texture = {TextureLayout::charts, side, side};
            auto made = Encoder::create(settings);
            if (!made) return tl::unexpected(made.error());
            encoder.emplace(std::move(*made));
            baker.emplace(TextureBakingOptions{.width = side, .height = side});
        }
        if (auto ok = encoder->push(**mesh, nullptr, capture->timestamp_us()); !ok) return ok;
        while (encoder->pull()) {
        }
        TexturedMesh shown(encoder->reconstruction());
        BakedFrame frame;
        frame.info = encoder->last_frame();
        const auto begin = std::chrono::steady_clock::now();
        auto baked = baker->bake(*captured, shown.mesh, encoder->repeated_vertices());
        if (!baked) return tl::unexpected(baked.error());
        frame.milliseconds =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        frame.charts = charts_of(shown.mesh);
        frame.share = share_of(shown.mesh);
        frame.seen = baked->seen;
        frame.gains = baked->gains;
        // As a player shows it.
        auto picture = std::make_shared<Image>(baked->picture);
        for (std::size_t at = 0; at < picture->rgb.size(); ++at)
            picture->rgb[at] =
                static_cast<std::uint8_t>(std::clamp(std::lround(picture->rgb[at] * baked->gains[at % 3]), 0L, 255L));
        shown.texture = picture;
        if (i % static_cast<std::size_t>(options.compare_every) == 0) {
            const auto errors = compare_pictures(options, i, capture->up(), *captured, shown);
            if (!errors) return tl::unexpected(errors.error());
            frame.unlit_db = psnr_foreground(*errors);
            frame.unlit_ssim = mean_similarity(errors->similarity);
        }
        if (!options.output.empty())
            if (auto ok = write_bytes(fmt::format("{}/texture_{:05}.png", options.output, i),
                                      write_png_image(baked->picture));
                !ok)
                return ok;
        if (!options.json) print(frame);
        frames.push_back(frame);
    }
    if (options.json) {
        nlohmann::json out = {{"frames", nlohmann::json::array()}};
        for (const auto& frame : frames) out["frames"].push_back(json_of(frame));
        fmt::print("{}\n", out.dump(2));
    }
    return {};
}

}  // namespace

void add_bake(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("bake", "Textures of a capture, in the layout of a stream's charts");
    auto& o = *options;
    add_capture_options(*command, o.capture);
    command->add_option("-o,--output", o.output,
                        "Folder for the pictures: texture_00000.png, and of frames that are compared view_00000.png, "
                        "the capture, what is shown and the difference beside each other");
    command->add_option("--size", o.size, "Side of the pictures, pixels; 0: as fine as the capture's")
        ->check(CLI::Range(0, largest_image_side))
        ->type_name("PIXELS");
    command->add_option("-q,--quality", o.quality, "Of the mesh, as of htvm encode")->check(CLI::Range(0.0, 100.0));
    command->add_option("--views", o.views, "Cameras around the subject")->check(CLI::Range(1, 100));
    command->add_option("--width", o.width, "Pixels of the pictures that are compared")->check(CLI::Range(16, 4096));
    command->add_option("--picture-height", o.height, "Pixels of the pictures that are compared")
        ->check(CLI::Range(16, 4096));
    command->add_option("--compare-every", o.compare_every, "Frames are compared that are so many apart")
        ->check(CLI::Range(1, 1000000));
    command->add_flag("--json", o.json, "Print as JSON");
    command->footer(
        "Encodes the capture's meshes with charts, lays each frame's texture out in them, and shows the result "
        "beside the capture: what the layout and the tracking cost, before any video coding.\n"
        "  htvm synth textured --frames 10 --texture 1024\n"
        "  htvm-lab bake textured/ -o out/baked");
    command->callback([options, &run] { run = [options] { return bake(*options); }; });
}

}  // namespace htvm::lab
