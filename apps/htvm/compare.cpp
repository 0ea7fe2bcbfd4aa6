// htvm compare: the metrics of a decoded sequence against its original.
#include "metrics/compare.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "command_line/capture.h"
#include "command_line/choice.h"
#include "command_line/headings.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "comparison_measuring.h"
#include "comparison_report.h"
#include "comparison_request.h"
#include "comparison_sources.h"
#include "core/thread.h"
#include "io/mesh_file.h"
#include "picture_options.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

void choose_metrics(ComparisonRequest& options) {
    CompareOptions& c = options.compare;
    if (c.views.views == 0) {
        c.pictures = options.flicker = false;
        c.views.views = 1;
    }
    c.render.colours = !options.shading.grey;
    c.render.shading = options.shading.shading.value_or(Shading::smooth);
    if (options.only.empty()) {
        options.coverage_if_open = !c.coverage;
        return;
    }
    const std::set<std::string> only(options.only.begin(), options.only.end());
    c.points = only.contains("m1");
    c.surface = only.contains("m2");
    c.regions = only.contains("regions");
    c.coverage = c.coverage || only.contains("coverage");
    c.texcoords = only.contains("texcoords");
    c.cloud = only.contains("d1") || only.contains("d2");
    c.pictures = c.pictures && only.contains("m3");
    c.topology = only.contains("topology");
    options.flicker = options.flicker && only.contains("flicker");
}

Result<void> compare(ComparisonRequest options) {
    choose_metrics(options);
    if (!options.pictures.empty()) {
        std::error_code error;
        std::filesystem::create_directories(options.pictures, error);
        if (error) return fail(ErrorKind::bad_input, options.pictures + " cannot be made: " + error.message());
    }
    auto sources = open_sources(options);
    if (!sources) return tl::unexpected(sources.error());
    auto pairs = pairs_of(*sources);
    if (options.frames > 0 && pairs.size() > options.frames)
        pairs.resize(options.frames);  // frames behind these were not asked for
    else
        warn_of_frames_left_out(*sources, pairs);
    if (options.follow_sequence) {
        const auto box = sequence_box(options, pairs);
        if (!box) return tl::unexpected(box.error());
        options.compare.view_box = *box;
    }
    const internal::ThreadPool pool(options.threads);
    options.compare.threads = pool.threads();
    const auto measured = measure(options, *sources, pairs);
    if (!measured) return tl::unexpected(measured.error());
    // The PSNR of each frame uses the peak of the sequence, so that frames can be compared with each other.
    const double peak_mm = summarise(measured->sums, options.peak_mm).peak_mm;
    if (!options.csv.empty())
        if (auto ok = write_csv(options, *measured, peak_mm); !ok) return ok;
    if (options.json) {
        fmt::print("{}\n", as_json(options, *measured, peak_mm).dump(2));
    } else if (options.csv != "-") {
        fmt::print("{}", as_table(options, *measured));
    }
    return {};
}

// All names but the last are originals, as a shell makes many of a pattern. It makes them of two patterns as well, and
// then nobody can tell where the second begins.
void take_apart(ComparisonRequest& options) {
    options.originals = {options.first};
    options.originals.insert(options.originals.end(), options.others.begin(), options.others.end() - 1);
    options.decoded = options.others.back();
    std::error_code error;
    if (options.originals.size() > 1 && std::filesystem::is_regular_file(options.decoded, error) &&
        is_mesh_file_name(options.decoded))
        throw CLI::ValidationError(
            "DECODED", options.decoded + " is one mesh, behind several originals; give patterns in quotes, or folders");
}

void add_sequences(CLI::App& command, ComparisonRequest& o) {
    command.add_option("ORIGINAL", o.first, "A mesh file, folder, glob or %05d pattern; or several files")
        ->type_name("FILE")
        ->required();
    command
        .add_option("DECODED", o.others,
                    "The same for the decoded meshes, or an .htvm stream; behind several originals a stream or a "
                    "folder")
        ->type_name("FILE")
        ->expected(1, -1)
        ->required();
    command.add_option("--frames", o.frames, "Compare at most this many frames; 0: all (default: all)")
        ->group(heading::input);
    add_unit(command, o.unit, "auto", "Unit of the files: mm, cm, dm, m, in, ft, or auto (by the first frame's size)")
        ->default_str("auto")
        ->group(heading::input);
    command
        .add_option(
            "--timestamps", o.timestamps,
            "When each original was captured, as for 'htvm encode', if frames of a stream are to find theirs by it")
        ->type_name("FILE")
        ->group(heading::input);
    command.add_option("--ignore", o.ignored, "Originals that are no frames, by a glob, as for 'htvm encode'")
        ->type_name("GLOB")
        ->allow_extra_args(false)
        ->group(heading::input);
    add_texture_options(command, o.texture);
}

void add_measurements(CLI::App& command, ComparisonRequest& o) {
    command.option_defaults()->group(heading::measurements);
    command
        .add_option("--only", o.only,
                    "Measure only some of m1, m2, regions, coverage, texcoords, d1, d2, m3, flicker, topology,\n"
                    "separated by commas")
        ->delimiter(',')
        ->check(one_of({"m1", "m2", "regions", "coverage", "texcoords", "d1", "d2", "m3", "flicker", "topology"}))
        ->option_text("LIST");
    command
        .add_option("--covered-within", o.compare.coverage_options.within,
                    "Measure coverage, and take a place for covered if the other surface lies within so many mm")
        ->check(CLI::Range(0.001, 1e6))
        ->capture_default_str()
        ->type_name("MM")
        ->each([&o](const std::string&) { o.compare.coverage = true; });
    command
        .add_option("--truth", o.truth,
                    "What 'htvm synth --truth' wrote beside the originals: measures how far the decoded surface\n"
                    "slides along the true one while its triangles stay the same, by frames since they were new; with\n"
                    "coverage also how much of the true surface either shows, and how near they are to it")
        ->type_name("FOLDER");
    command.add_option("--samples", o.compare.surface_options.samples,
                       "Samples for M2, in each direction (default: 10 times the triangles, like METRO)");
    command.add_option("--seed", o.compare.surface_options.seed, "Seed of M2's samples")->capture_default_str();
    command.add_option("--peak", o.peak_mm, "Peak of D1 and D2, mm (default: the originals' bounding box diagonal)")
        ->check(CLI::PositiveNumber);
    command.add_option("--crack-width", o.compare.topology_options.crack_width,
                       "Widest crack, mm (default: half of the mean edge length)");
    command.add_option("--flap-distance", o.compare.topology_options.flap_distance,
                       "Largest distance of a flap's layers, mm (default: the same)");
}

void add_pictures(CLI::App& command, ComparisonRequest& o) {
    command.option_defaults()->group(heading::pictures);
    ViewOptions& v = o.compare.views;
    command.add_option("--views", v.views, "Views around the body for M3 and flicker; 0: neither")
        ->check(CLI::Range(0, 1000))
        ->capture_default_str();
    add_camera_options(command, v, "");
    add_shading_options(command, o.shading, "");
    command.add_flag("--still-camera", o.follow_sequence,
                     "The cameras look at the box around the whole sequence instead of each frame's own\n"
                     "(reads the originals twice)");
    command.add_option("--pictures", o.pictures, "Folder for PNG files: original, decoded, difference (4-fold)")
        ->type_name("FOLDER");
    command.add_option("--picture-views", o.picture_views, "How many of the views are written")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
}

void add_results(CLI::App& command, ComparisonRequest& o) {
    command.option_defaults()->group(heading::output);
    command
        .add_option("--csv", o.csv,
                    "One line per frame to this file, or - for standard output; an infinite PSNR is inf")
        ->type_name("FILE");
    command.add_flag("--json", o.json, "Everything as JSON on standard output; an infinite PSNR is null");
    command.add_option("--threads", o.threads, "Threads to use (default: one per core); the result is the same")
        ->group(heading::parallel);
}

constexpr const char* what_is_measured =
    "Measure decoded meshes against their originals, frame by frame: by the times that streams and PLY files\n"
    "tell, else by the numbers in their names, or in the order of their names if they have none:\n"
    "  M1  vertex to nearest vertex, and the colour there (RMS, both ways; the paper's eq. 9, 10)\n"
    "  M2  point to surface, as METRO samples it (RMS, mean, largest; both ways; eq. 11, 12)\n"
    "  regions  the worst region of the surface, a ball of 10 cm: RMS distance there, in the worse direction; of\n"
    "      frames their median, 99th percentile and largest, of a stream's I-frames and its others apart\n"
    "  coverage  by default where the capture is open, as depth cameras' are: the share of the captured surface\n"
    "      within 5 mm of what is shown, and of the shown surface within it of the captured; M2 and worst regions\n"
    "      over what is covered; and the area that appears and vanishes from frame to frame, in both\n"
    "  texture coordinates, at closest points of the surface; where they differ by more than 1/16 of the atlas "
    "they\n"
    "      are elsewhere in it, and counted by themselves\n"
    "  D1, D2  point-to-point and point-to-plane PSNR, as MPEG's point cloud metric\n"
    "  M3  PSNR and SSIM of pictures from all sides; unlit M3: of the same pictures without shading, which show\n"
    "      texture, where there are colours\n"
    "  flicker  how such pictures change from frame to frame, decoded beside original: a ratio of 1 is as calm "
    "as\n"
    "      the original; and how much the decoded ones change where the original is still; of a stream by kind of\n"
    "      frame, and beside the T-frames around it\n"
    "  topology  components, boundaries, cracks, flaps";

}  // namespace

void add_compare(CLI::App& app, Run& run) {
    auto options = std::make_shared<ComparisonRequest>();
    auto& o = *options;
    CLI::App* command = app.add_subcommand("compare", "Measure decoded meshes against their originals");
    command->description(what_is_measured);
    add_sequences(*command, o);
    add_measurements(*command, o);
    add_pictures(*command, o);
    add_results(*command, o);
    add_decoder_limits(*command, o.limits);
    command->option_defaults()->group("Options");
    command->footer(
        "Examples:\n"
        "  htvm compare capture/ person.htvm\n"
        "  htvm compare 'scan_%05d.obj' meshes/ --only m1,m2 --csv errors.csv");
    add_front_page(*command, {{{"--only"},
                               {"--frames"},
                               {"--unit"},
                               {"--views"},
                               {"--shading"},
                               {"--pictures"},
                               {"--csv"},
                               {"--json"},
                               {"--threads"}}});
    command->callback([options, &run] {
        take_apart(*options);
        run = [options] { return compare(*options); };
    });
}

}  // namespace htvm::app
