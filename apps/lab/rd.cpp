// htvm-lab rd: rates and distortions of our coders and their peers over a sequence.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "charts.h"
#include "coders.h"
#include "command_line/capture.h"
#include "command_line/choice.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/parallel.h"
#include "io/sequence.h"
#include "metrics/surface_border.h"
#include "results.h"
#include "sweep.h"

namespace htvm::lab {

using namespace app;
using namespace internal;
namespace {

using std::filesystem::path;

// The coders that all others are compared with.
constexpr std::array<const char*, 3> rate_references = {"draco10", "tfan", "tfan-mpeg"};

struct Options {
    CaptureOptions capture;
    std::vector<double> qualities{20, 35, 50, 65, 80};
    std::vector<std::string> coders{"htvm-t", "htvm-ep", "paper", "tfan", "tfan-mpeg", "draco10"};
    std::vector<std::string> peers;
    std::vector<std::string> metrics{"m1", "m2"};
    std::uint64_t samples = 200000;
    std::size_t measure_every = 1;
    int key_interval = 0;
    Denoising denoise = Denoising::off;
    int views = 10;
    std::size_t memory_megabytes = 1024;
    unsigned threads = 0, coder_threads = 1;
    bool coverage_if_open = true;  // measure coverage, too, if the first captured mesh is open
    bool geometry_only = false, keep_frames = false, again = false, png = false, json = false;
    std::string output;
};

Result<std::vector<CoderUnderTest>> chosen_coders(const Options& options) {
    const auto built_in = built_in_coders(options.key_interval, options.denoise);
    std::vector<CoderUnderTest> out;
    std::set<std::string> names;
    auto add = [&](const CoderUnderTest& coder) -> Result<void> {
        if (!names.insert(coder.name).second)
            return fail(ErrorKind::bad_input, "the coder " + coder.name + " is asked for twice");
        out.push_back(coder);
        return {};
    };
    for (const auto& name : options.coders) {
        if (name == "none") continue;
        const auto found =
            std::find_if(built_in.begin(), built_in.end(), [&](const CoderUnderTest& c) { return c.name == name; });
        if (found == built_in.end()) {
            std::vector<std::string> known;
            for (const auto& coder : built_in) known.push_back(coder.name);
            return fail(ErrorKind::bad_input, "--coders: " + none_of(name, known));
        }
        if (auto ok = add(*found); !ok) return tl::unexpected(ok.error());
    }
    for (const auto& peer : options.peers) {
        const auto coder = peer_under_test(peer);
        if (!coder) return tl::unexpected(coder.error());
        if (auto ok = add(*coder); !ok) return tl::unexpected(ok.error());
    }
    if (out.empty()) return fail(ErrorKind::bad_input, "there is no coder to measure: see --coders and --peer");
    return out;
}

CompareOptions compare_options(const Options& options) {
    const std::set<std::string> metrics(options.metrics.begin(), options.metrics.end());
    CompareOptions out;
    out.points = metrics.contains("m1");
    out.surface = metrics.contains("m2");
    out.regions = metrics.contains("regions");
    out.pictures = metrics.contains("m3");
    out.cloud = metrics.contains("d1");
    out.coverage = metrics.contains("coverage");
    out.topology = false;
    out.surface_options.samples = options.samples;
    out.views.views = options.views;
    return out;
}

// Everything that a result depends on besides its coder and quality.
Result<std::string> common_key(const Options& options) {
    const auto files = find_sequence(options.capture.inputs, {options.capture.ignored});
    if (!files) return tl::unexpected(files.error());
    auto inputs = files->paths;
    auto textures = TextureFiles::open(options.capture.texture, *files);
    if (!textures) return tl::unexpected(textures.error());
    for (const auto& image : textures->known_images()) inputs.push_back(image);
    if (!options.capture.skeleton.empty()) inputs.emplace_back(options.capture.skeleton);
    std::string metrics;
    for (const auto& metric : std::set<std::string>(options.metrics.begin(), options.metrics.end()))
        metrics += metric + " ";
    if (options.coverage_if_open) metrics += "coverage if open ";
    return fmt::format("{}; {}; geometry only {}; {}samples {}, views {}, every {}; coder threads {}",
                       fingerprint(inputs), key_of(options.capture), options.geometry_only, metrics, options.samples,
                       options.views, options.measure_every, options.coder_threads);
}

struct Task {
    SweepJob job;
    std::string name, key;
    std::optional<RdPoint> result;
};

// Decoded frames from an earlier run are used if they are complete.
bool has_files(const path& folder, std::size_t count) {
    if (folder.empty()) return true;
    std::error_code error;
    std::size_t found = 0;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        if (entry->path().extension() == ".ply") ++found;
    return found == count;
}

std::vector<Task> make_tasks(const Options& options, const std::vector<CoderUnderTest>& coders,
                             const std::string& common) {
    std::vector<Task> tasks;
    auto qualities = options.qualities;
    std::sort(qualities.begin(), qualities.end());
    qualities.erase(std::unique(qualities.begin(), qualities.end()), qualities.end());
    for (const auto& coder : coders) {
        for (const double quality : qualities) {
            Task task;
            task.job.coder = &coder;
            task.job.quality = quality_point(quality);
            task.job.quality.threads = options.coder_threads;
            task.name = fmt::format("{}_q{:g}", coder.name, quality);
            task.key = fmt::format("{}; {}: {}; quality {}", common, coder.name, coder.settings, quality);
            if (options.keep_frames) task.job.keep_frames = path(options.output) / "frames" / task.name;
            tasks.push_back(std::move(task));
        }
    }
    return tasks;
}

// Codes and measures whatever no earlier run has stored.
Result<void> run_tasks(const Options& options, const ResultCache& cache, Capture& capture, std::vector<Task*> missing) {
    const WorkFolder work(path(options.output) / "work");
    if (auto made = make_folder(work.where); !made) return made;
    SourceOptions source_options;
    source_options.geometry_only = options.geometry_only;
    source_options.memory_bytes = options.memory_megabytes << 20;
    source_options.spill_folder = work.where;
    const auto source = SourceFrames::load(capture, source_options);
    if (!source) return tl::unexpected(source.error());
    std::vector<SweepJob> jobs;
    for (auto* task : missing) {
        task->job.quality.working_folder = work.where / task->name;
        if (auto made = make_folder(task->job.quality.working_folder); !made) return made;
        if (!task->job.keep_frames.empty())
            if (auto made = make_folder(task->job.keep_frames); !made) return made;
        jobs.push_back(task->job);
    }
    SweepOptions sweep_options;
    sweep_options.compare = compare_options(options);
    if (options.coverage_if_open) {
        const auto first = source->frame(0);
        if (!first) return tl::unexpected(first.error());
        sweep_options.compare.coverage = is_open((*first)->mesh);
    }
    sweep_options.measure_every = options.measure_every;
    sweep_options.threads = thread_count(options.threads);
    std::vector<std::string> failures;
    Progress progress("coding and measuring", jobs.size() * source->size());
    sweep(
        jobs, *source, sweep_options,
        [&](std::size_t i, Result<RdPoint> result) {
            if (!result) {
                failures.push_back(result.error().message);
                return;
            }
            if (auto kept = cache.keep(missing[i]->name, missing[i]->key, *result); !kept) warn(kept.error().message);
            missing[i]->result = std::move(*result);
        },
        [&] { progress.step(); });
    for (const auto& failure : failures) warn(failure);
    return {};
}

std::string capture_title(const Options& options, const RdPoint& point) {
    auto input = path(input_name(options.capture)).lexically_normal();
    std::string name = (input.has_filename() ? input.filename() : input.parent_path().filename()).string();
    if (name.find_first_of("%*?") != std::string::npos) name = (input.parent_path().filename() / name).string();
    const auto sums = totals(point);
    const double vertices = static_cast<double>(sums.source_vertices) / static_cast<double>(sums.frames);
    return fmt::format("{}: {} frames of {:.0f} vertices{}, {:g} frames/s", name, sums.frames, vertices,
                       sums.bytes[Layer::colour] == 0 ? " without colour" : "", point.fps);
}

void print_tables(const Options& options, const std::string& title, const std::vector<RdPoint>& points) {
    fmt::print("{}\n\n{}", title, rate_table(points));
    if (const auto table = enhanced_frame_table(points); !table.empty()) fmt::print("\n{}", table);
    if (const auto table = region_table(points); !table.empty()) fmt::print("\n{}", table);
    if (const auto table = coverage_table(points); !table.empty()) fmt::print("\n{}", table);
    for (const char* reference : rate_references)
        if (const auto table = rate_difference_table(points, reference); !table.empty()) fmt::print("\n{}", table);
    std::string crossings;
    for (const char* coder : {"paper", "htvm-ep"})
        for (const char* peer : {"tfan", "tfan-mpeg"}) crossings += crossing_sentence(points, coder, peer);
    if (!crossings.empty()) fmt::print("\n{}", crossings);
    fmt::print(
        "\n"
        "bpvf and layers: bits per captured vertex, all frames, including I-frames. one piece: what a coder does\n"
        "not split up (geometry with connectivity). Rate differences: Bjontegaard, n/a without a common range.\n");
    if (std::ranges::find(options.metrics, "regions") != options.metrics.end())
        fmt::print(
            "regions: RMS error of a frame's worst region of 10 cm, 99th percentile over frames; patched: share of "
            "the\n"
            "surface that patches replace in a T- or TP-frame, on average.\n");
    if (std::string(equal_m2_measure(points).key) == "covered_m2_mm")
        fmt::print(
            "coverage: share of the captured surface within 5 mm of what is shown, and of the shown surface within it "
            "of\n"
            "the captured; M2 and the worst region (99th percentile over frames) over what is covered. Bits at equal "
            "M2 "
            "are\n"
            "those at equal M2 over what is covered (M2 cov.), which is fair at like coverage: see both.\n");
    if (std::ranges::find(options.metrics, "m3") != options.metrics.end())
        fmt::print("M3 fgr, SSIM: of the foreground of lit pictures; unlit, u.SSIM: of the same without shading.\n");
    if (options.coder_threads == 1)
        fmt::print("Speeds: processor time of one thread (peers: the wall clock, coding and decoding together).\n");
}

nlohmann::json as_json(const Options& options, const std::string& title, const std::vector<RdPoint>& points) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& point : points) list.push_back(to_json(point));
    nlohmann::json differences;
    for (const char* reference : rate_references) differences[reference] = rate_differences_json(points, reference);
    return {{"program", "htvm-lab " HTVM_VERSION},        {"capture", title},
            {"input", input_name(options.capture)},       {"surface_samples", options.samples},
            {"coder_threads", options.coder_threads},     {"points", std::move(list)},
            {"rate_differences", std::move(differences)}, {"equal_m2", equal_m2_measure(points).key}};
}

Result<void> write_outputs(const Options& options, const std::vector<RdPoint>& points) {
    const std::string title = capture_title(options, points.front());
    const path folder(options.output);
    const auto json = as_json(options, title, points).dump(1);
    if (auto ok = write_text(folder / "rd.json", json + "\n"); !ok) return ok;
    if (auto ok = write_text(folder / "rd.csv", rd_csv(points)); !ok) return ok;
    const auto drawn = draw_curves(points, {title, folder, options.png});
    if (!drawn) return tl::unexpected(drawn.error());
    if (options.json)
        fmt::print("{}\n", json);
    else
        print_tables(options, title, points);
    std::fflush(stdout);
    if (!*drawn) warn("no curves: gnuplot is not installed (Debian: gnuplot-nox); curves.gp holds what it would draw");
    note(fmt::format("{}: rd.json, rd.csv{}", folder.string(), *drawn ? " and the curves" : ""));
    return {};
}

Result<void> rate_distortion(const Options& options) {
    if (is_piped(options.capture))
        return fail(ErrorKind::bad_input, "the sweep keeps its results by the files they came from: give files, not -");
    const auto coders = chosen_coders(options);
    if (!coders) return tl::unexpected(coders.error());
    const auto common = common_key(options);
    if (!common) return tl::unexpected(common.error());
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    const ResultCache cache(path(options.output) / "results");
    if (auto made = make_folder(path(options.output) / "results"); !made) return made;
    auto tasks = make_tasks(options, *coders, *common);
    std::vector<Task*> missing;
    for (auto& task : tasks) {
        if (!options.again) task.result = cache.find(task.name, task.key);
        if (!task.result || !has_files(task.job.keep_frames, task.result->frames.size())) missing.push_back(&task);
    }
    if (missing.size() < tasks.size())
        note(fmt::format("{} of {} results are kept from earlier runs", tasks.size() - missing.size(), tasks.size()));
    if (!missing.empty())
        if (auto ran = run_tasks(options, cache, *capture, missing); !ran) return ran;
    std::vector<RdPoint> points;
    for (auto& task : tasks)
        if (task.result) points.push_back(std::move(*task.result));
    if (points.empty()) return fail(ErrorKind::bad_input, "no coder gave a result");
    if (auto written = write_outputs(options, points); !written) return written;
    if (points.size() < tasks.size())
        return fail(ErrorKind::bad_input, "some coders failed; the tables leave them out");
    return {};
}

void add_sweep_options(CLI::App& command, Options& o) {
    command.add_option("-o,--output", o.output, "Folder for results, tables and curves; results in it are used again")
        ->type_name("FOLDER")
        ->required();
    command
        .add_option("-q,--quality", o.qualities,
                    "Qualities, separated by commas (default 20,35,50,65,80; see htvm encode)")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 100.0))
        ->option_text("LIST");
    command
        .add_option(
            "--coders", o.coders,
            "Coders, separated by commas (default htvm-t,htvm-ep,paper,tfan,tfan-mpeg,draco10); none: only peers:\n"
            "  htvm-t   I- and T-frames, as htvm encode: a simplified mesh laid on each frame's surface\n"
            "  paper    I- and EP-frames as in the paper (reference vertices by bone)\n"
            "  htvm-ep  the same with reference vertices from the whole mesh, as htvm encode --profile topology\n"
            "  htvm-motion  htvm-ep by motion-based coding: what fits the capture is animated, not coded\n"
            "  htvm-rd  I-, EP- and P-frames chosen by measured bits and errors (slow)\n"
            "  tfan     our TFAN alone, every frame an I-frame\n"
            "  tfan-mpeg  TFAN as published and in MPEG-4: no contexts, one parallelogram; every frame by itself\n"
            "  draco10, draco7  libdraco at compression level 10, 7, every frame by itself")
        ->delimiter(',')
        ->option_text("LIST");
    command.add_option("--peer", o.peers, "NAME=COMMAND: another coder, see below; may be repeated")
        ->option_text("NAME=COMMAND ...")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command
        .add_option(
            "--metrics", o.metrics,
            "Any of m1, m2, m3 (pictures, also unlit, PSNR and SSIM: slow), d1 (with d2), regions (the worst\n"
            "region of 10 cm, of I-frames and of the others: 99th percentile over frames), coverage (and errors\n"
            "over what is covered); default m1,m2, and coverage where the capture is open")
        ->delimiter(',')
        ->check(one_of({"m1", "m2", "m3", "d1", "regions", "coverage"}))
        ->option_text("LIST");
    command.add_option(
        "--samples", o.samples,
        "Samples for M2 in each direction (default 200000, within 1 % of METRO's 10 per triangle; 0: that)");
    command.add_option("--measure-every", o.measure_every, "Measure errors on every n-th frame (default 1)")
        ->check(CLI::Range(1, 1000000));
    command.add_option("--views", o.views, "Views for M3 (default 10)")->check(CLI::Range(1, 1000));
    command
        .add_option("--keyint", o.key_interval,
                    "Frames from one I-frame to the next (default: 300 for htvm-t, 30 for others)")
        ->check(CLI::Range(1, 1000000));
    constexpr std::array denoising = {Choice<Denoising>{"auto", Denoising::automatic},
                                      Choice<Denoising>{"off", Denoising::off}};
    add_choice(command, "--denoise", o.denoise, denoising,
               "Whether htvm-t leaves the capture's noise out: off (default), since errors are measured against the "
               "capture, noise and all; or auto, as htvm encode does");
    command.add_flag("--geometry-only", o.geometry_only, "Leave the colours out");
}

void add_running_options(CLI::App& command, Options& o) {
    command.add_option("--threads", o.threads, "Coders that run at once (default: one per core)");
    command
        .add_option("--coder-threads", o.coder_threads,
                    "Threads of each of our coders (default 1: speeds are then processor time of one thread)")
        ->check(CLI::Range(1, 256));
    command.add_option("--memory", o.memory_megabytes,
                       "Megabytes of captured meshes to hold; more wait in files (default 1024)");
    command.add_flag("--keep-frames", o.keep_frames, "Keep the decoded frames as PLY in OUTPUT/frames");
    command.add_flag("--again", o.again, "Do not use results of earlier runs");
    command.add_flag("--png", o.png, "Draw the curves as PNG too");
    command.add_flag("--json", o.json, "Print rd.json on standard output instead of tables");
}

}  // namespace

void add_rd(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("rd", "Rate-distortion of our coders and their peers: tables and curves");
    add_capture_options(*command, options->capture);
    add_sweep_options(*command, *options);
    add_running_options(*command, *options);
    command->footer(
        "Every coder codes the whole sequence at every quality; all get the same steps. Draco's position bits are\n"
        "those whose cell over the average frame's bounding box is nearest to the step. Draco codes colours only\n"
        "losslessly, so they are quantised to our colour step first. Normals and texture coordinates are left out.\n"
        "Results are kept in OUTPUT/results, and measured again if the inputs, the options or the program changed.\n\n"
        "A peer's COMMAND is run once per frame by the shell, with these replaced:\n"
        "  {in}       binary PLY of the frame, mm          {out}      the file to write, whose size is the rate\n"
        "  {decoded}  PLY to write, decoded from {out}     {q}        quality, 0 to 100\n"
        "  {step} {colour_step}  our steps there, mm and levels       {bits}  position bits, as for Draco\n"
        "Exit status 0 is success.\n\n"
        "Examples:\n"
        "  htvm-lab rd capture/ -s capture/skeleton.json -o out/rd --png\n"
        "  htvm-lab rd capture/ -o out/rd --peer 'cl4=draco_encoder -i {in} -o {out} -cl 4 -qp {bits} &&\n"
        "      cp {out} {out}.drc && draco_decoder -i {out}.drc -o {decoded}'\n"
        "Bits by layer of 60 frames of the synthetic capture at three qualities, with TFAN and Draco:\n"
        "  htvm synth out/synth --frames 60\n"
        "  htvm-lab rd out/synth -s out/synth/skeleton.json -q 35,50,65 --coders paper,htvm-ep,tfan,draco10,draco7 -o "
        "out/rd");
    command->callback([options, command, &run] {
        options->coverage_if_open = command->count("--metrics") == 0;
        run = [options] { return rate_distortion(*options); };
    });
}

}  // namespace htvm::lab
