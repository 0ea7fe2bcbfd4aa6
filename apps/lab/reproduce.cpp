#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "command_line/capture.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/parallel.h"
#include "experiments.h"
#include "figures.h"
#include "findings.h"
#include "galleries.h"
#include "io/sequence.h"
#include "one_camera_capture.h"
#include "page.h"
#include "sweep.h"

namespace htvm::lab {

using namespace app;
using namespace internal;
namespace {

using std::filesystem::path;

struct Options {
    CaptureOptions capture;
    std::string output, title, true_skeleton;
    std::vector<int> figures;
    int key_interval = 30;
    std::optional<double> azimuth;
    unsigned threads = 0;
    std::size_t memory_megabytes = 1024;
    bool quick = false;
};

std::set<int> wanted_figures(const Options& options) {
    if (!options.figures.empty()) return {options.figures.begin(), options.figures.end()};
    if (options.quick) return {6, 7, 8, 10, 17, 18, 19, 21, 22, 23, 24, 25};
    std::set<int> all;
    for (int number = 6; number <= 25; ++number) all.insert(number);
    return all;
}

bool any_of(const std::set<int>& wanted, std::initializer_list<int> numbers) {
    return std::any_of(numbers.begin(), numbers.end(), [&](int number) { return wanted.contains(number); });
}

ExperimentPlan plan_of(const Options& options) {
    ExperimentPlan plan;
    plan.key_interval = options.key_interval;
    if (options.quick) {
        plan.qualities = {10, 20, 35, 50, 70};
        plan.surface_samples = 50000;
        plan.most_measured = 5;
        plan.thresholds = 3;
        plan.intervals = {1, 3, 10};
        plan.interval_qualities = {60};
        plan.camera_frames = 10;
    }
    return plan;
}

std::string capture_name(const Options& options) {
    if (!options.title.empty()) return options.title;
    const auto input = path(input_name(options.capture)).lexically_normal();
    std::string name = (input.has_filename() ? input.filename() : input.parent_path().filename()).string();
    if (name.find_first_of("%*?") != std::string::npos) name = input.parent_path().filename().string();
    return name;
}

// The true skeleton: the one given, or the one that htvm synth writes next to the noisy one.
std::string true_skeleton_file(const Options& options) {
    if (!options.true_skeleton.empty()) return options.true_skeleton;
    const path given(options.capture.skeleton);
    if (given.filename() != "skeleton.json") return {};
    const auto beside = given.parent_path() / "skeleton_true.json";
    std::error_code error;
    return std::filesystem::exists(beside, error) ? beside.string() : std::string();
}

// One per frame; none without a skeleton.
Result<std::vector<Pose>> tracked_poses(const SourceFrames& source) {
    std::vector<Pose> out;
    for (std::size_t i = 0; i < source.size(); ++i) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        if ((*frame)->pose) out.push_back(*(*frame)->pose);
    }
    if (out.size() != source.size()) out.clear();
    return out;
}

// The poses that noise is added to, one per frame; none without a skeleton.
Result<std::vector<Pose>> poses_for_noise(const Options& options, const SourceFrames& source) {
    const auto truth = true_skeleton_file(options);
    if (truth.empty()) return tracked_poses(source);
    std::vector<Pose> out;
    auto capture_options = options.capture;
    capture_options.skeleton = truth;
    auto capture = Capture::open(capture_options);
    if (!capture) return tl::unexpected(capture.error());
    while (out.size() < source.size()) {
        const auto mesh = capture->next();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh || !capture->pose()) break;
        out.push_back(*capture->pose());
    }
    if (out.size() != source.size() || out[0].joints.size() != source.facts().skeleton.joint_names.size())
        return fail(ErrorKind::bad_input, truth + " does not fit the capture's skeleton or its number of frames");
    return out;
}

Result<Laboratory> laboratory_of(const Options& options, const SourceFrames& source) {
    const auto files = find_sequence(options.capture.inputs, {options.capture.ignored});
    if (!files) return tl::unexpected(files.error());
    auto inputs = files->paths;
    auto textures = TextureFiles::open(options.capture.texture, *files);
    if (!textures) return tl::unexpected(textures.error());
    for (const auto& image : textures->known_images()) inputs.push_back(image);
    for (const auto& name : {options.capture.skeleton, true_skeleton_file(options)})
        if (!name.empty()) inputs.emplace_back(name);
    auto measured = options.capture;
    measured.frames = source.size();
    Laboratory out{&source,
                   ResultCache(path(options.output) / "results"),
                   {},
                   path(options.output) / "work",
                   thread_count(options.threads)};
    out.common_key = fmt::format("{}; {}", fingerprint(inputs), key_of(measured));
    for (const auto& folder : {path(options.output) / "results", path(options.output) / "figures", out.work_folder})
        if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
    return out;
}

// Measures one group of trials into `points`.
Result<void> measure_into(std::vector<RdPoint>& points, const Laboratory& laboratory, const std::string& name,
                          const std::vector<Trial>& trials, const SweepOptions& options) {
    note(fmt::format("{}: {} measurements on {} frames", name, trials.size(), laboratory.source->size()));
    auto measured = measure_trials(laboratory, name, trials, options);
    if (!measured) return tl::unexpected(measured.error());
    points = std::move(*measured);
    return {};
}

SweepOptions sweep_options(const Laboratory& laboratory, const ExperimentPlan& plan, std::size_t every, bool surface,
                           bool pictures) {
    SweepOptions out;
    out.compare.points = true;
    out.compare.surface = surface;
    out.compare.pictures = pictures;
    out.compare.regions = out.compare.cloud = out.compare.topology = false;
    out.compare.surface_options.samples = plan.surface_samples;
    out.measure_every = every;
    out.threads = laboratory.threads;
    return out;
}

// Figures 7, 17 and 18: the effect of the thresholds on the skeleton's motion; without a skeleton, that of intervals.
Result<void> measure_choices(const Options& options, const Laboratory& laboratory, const ExperimentPlan& plan,
                             const std::set<int>& wanted, Findings& findings) {
    if (!any_of(wanted, {7, 17, 18, 19})) return {};
    const auto frames = laboratory.source->size();
    const auto poses = tracked_poses(*laboratory.source);
    if (!poses) return tl::unexpected(poses.error());
    findings.thresholds =
        motion_thresholds(laboratory.source->facts().skeleton, *poses, plan.key_interval, plan.thresholds);
    const auto none = sweep_options(laboratory, plan, frames, false, false);
    if (!findings.thresholds)
        return wanted.contains(7) ? measure_into(findings.intervals, laboratory, "figure 7: share of I-frames",
                                                 interval_trials(plan), none)
                                  : Result<void>();
    const auto& thresholds = *findings.thresholds;
    if (wanted.contains(7)) {
        if (auto ok = measure_into(findings.intra_choice, laboratory, "figure 7: share of I-frames",
                                   intra_choice_trials(plan, thresholds), none);
            !ok)
            return ok;
        if (auto ok =
                measure_into(findings.predicted_choice, laboratory, "figure 7: share of P-frames",
                             predicted_trials(plan, thresholds, !options.quick),
                             sweep_options(laboratory, plan, measure_every(frames, plan.most_measured), true, false));
            !ok)
            return ok;
    }
    if (!any_of(wanted, {17, 18, 19})) return {};
    findings.motion_every = measure_every(frames, options.quick ? 3 : 10);
    return measure_into(findings.motion, laboratory, "figures 17 and 18: motion-based coding",
                        motion_trials(plan, thresholds),
                        sweep_options(laboratory, plan, findings.motion_every, true, true));
}

// Figure 20 on one capture, for each power of the noise on its skeleton.
Result<void> measure_noise_into(std::vector<std::pair<double, std::vector<RdPoint>>>& noise, const std::string& name,
                                const Laboratory& laboratory, const ExperimentPlan& plan,
                                const std::vector<Pose>& poses) {
    const auto measuring =
        sweep_options(laboratory, plan, measure_every(laboratory.source->size(), plan.most_measured), false, false);
    for (const double power : plan.noise_powers) {
        noise.emplace_back(power, std::vector<RdPoint>{});
        if (auto ok = measure_into(noise.back().second, laboratory, fmt::format("{}: noise of {:g} mm^2", name, power),
                                   noise_trials(plan, poses, power), measuring);
            !ok)
            return ok;
    }
    return {};
}

// Figure 20 on the capture and, as the paper's is about one depth camera's, on a synthetic one of that kind.
Result<void> measure_noise(const Options& options, const Laboratory& laboratory, const ExperimentPlan& plan,
                           Findings& findings) {
    const auto poses = poses_for_noise(options, *laboratory.source);
    if (!poses) return tl::unexpected(poses.error());
    findings.true_skeleton = !true_skeleton_file(options).empty();
    if (!poses->empty())
        if (auto ok = measure_noise_into(findings.noise, "figure 20", laboratory, plan, *poses); !ok) return ok;
    SourceOptions source_options;
    source_options.memory_bytes = options.memory_megabytes << 20;
    source_options.spill_folder = laboratory.work_folder / "one_camera";
    if (auto made = make_folder(source_options.spill_folder); !made) return made;
    const ThreadPool pool(laboratory.threads);
    const auto capture = one_camera_capture(plan.camera_frames, source_options, pool.threads());
    if (!capture) return tl::unexpected(capture.error());
    Laboratory before_the_camera = laboratory;
    before_the_camera.source = &capture->source;
    before_the_camera.common_key = fmt::format("{}; {}", fingerprint({}), capture->key);
    findings.camera_capture = capture->key;
    return measure_noise_into(findings.camera_noise, "figure 20, one camera", before_the_camera, plan,
                              capture->true_poses);
}

Result<void> measure_curves(const Options& options, const Laboratory& laboratory, const ExperimentPlan& plan,
                            const std::set<int>& wanted, Findings& findings) {
    const auto frames = laboratory.source->size();
    findings.geometry_every = measure_every(frames, plan.most_measured);
    findings.colour_every = measure_every(frames, 10);
    auto run = [&](std::vector<RdPoint>& points, const char* name, const std::vector<Trial>& trials, std::size_t every,
                   bool surface = false, bool pictures = false) {
        return measure_into(points, laboratory, name, trials,
                            sweep_options(laboratory, plan, every, surface, pictures));
    };
    if (any_of(wanted, {6, 8, 9, 10}))
        if (auto ok = run(findings.geometry, "figures 6 and 10: geometry", geometry_trials(plan),
                          findings.geometry_every, true);
            !ok)
            return ok;
    if (auto ok = measure_choices(options, laboratory, plan, wanted, findings); !ok) return ok;
    if (any_of(wanted, {11, 12, 13, 14, 15}) && findings.has_colour)
        if (auto ok = run(findings.colour, "figures 11 to 13: colours", colour_trials(plan), findings.colour_every);
            !ok)
            return ok;
    if (wanted.contains(16))
        if (auto ok =
                run(findings.pictures, "figure 16: pictures", picture_trials(plan), plan.picture_every, false, true);
            !ok)
            return ok;
    return wanted.contains(20) ? measure_noise(options, laboratory, plan, findings) : Result<void>();
}

Result<void> measure_internals(const Options& options, const Laboratory& laboratory, const std::set<int>& wanted,
                               Findings& findings) {
    if (!any_of(wanted, {21, 22, 23, 24, 25})) return {};
    // The paper's 13.2 bpvf include colours; without colours, the middle of its figure 6.
    const double rate = findings.has_colour ? 13.2 : 10;
    const auto quality = quality_near_rate(*laboratory.source, rate, options.key_interval, options.threads);
    if (!quality) return tl::unexpected(quality.error());
    auto run = run_internals(*laboratory.source, *quality, options.key_interval, options.threads);
    if (!run) return tl::unexpected(run.error());
    findings.internals = std::move(*run);
    return {};
}

std::vector<Figure> histogram_figures(const Findings& findings, const std::set<int>& wanted, Easel& easel) {
    using Maker = Figure (*)(const InternalRun&, Easel&);
    const std::pair<int, Maker> makers[] = {
        {21, figure_21}, {22, figure_22}, {23, figure_23}, {24, figure_24}, {25, figure_25}};
    std::vector<Figure> out;
    if (!findings.internals) return out;
    const auto& run = *findings.internals;
    const bool any = std::any_of(run.frames.begin(), run.frames.end(),
                                 [](const InternalFrame& frame) { return frame.info.type == FrameType::enhanced; });
    for (const auto& [number, make] : makers) {
        if (!wanted.contains(number)) continue;
        if (any)
            out.push_back(make(run, easel));
        else
            out.push_back({std::to_string(number), "EP-frames", {}, {}, {}, {}, {}, "the run has no EP-frame."});
    }
    return out;
}

std::vector<Figure> chart_figures(const Findings& findings, const ExperimentPlan& plan, const std::set<int>& wanted,
                                  Easel& easel) {
    std::vector<Figure> out;
    if (wanted.contains(6)) out.push_back(figure_6(findings, easel));
    if (wanted.contains(7)) {
        out.push_back(findings.thresholds ? figure_7_by_motion(findings, plan, easel)
                                          : figure_7(findings, plan, easel));
        out.push_back(figure_7_predicted(findings, easel));
    }
    if (wanted.contains(10)) out.push_back(figure_10(findings, easel));
    if (wanted.contains(11)) out.push_back(figure_11(findings, plan, easel));
    if (wanted.contains(12)) out.push_back(figure_12(findings, plan, easel));
    if (wanted.contains(13)) out.push_back(figure_13(findings, plan, easel));
    if (wanted.contains(16)) out.push_back(figure_16(findings, plan, easel));
    if (wanted.contains(20)) {
        out.push_back(figure_20(findings, easel));
        out.push_back(figure_20_of_one_camera(findings, easel));
    }
    if (wanted.contains(17)) out.push_back(figure_17(findings, easel));
    if (wanted.contains(18)) out.push_back(figure_18(findings, easel));
    auto histograms = histogram_figures(findings, wanted, easel);
    std::move(histograms.begin(), histograms.end(), std::back_inserter(out));
    return out;
}

double mean_vertices(const SourceFrames& source) {
    double sum = 0;
    for (std::size_t i = 0; i < source.size(); ++i)
        if (const auto frame = source.frame(i)) sum += static_cast<double>((*frame)->mesh.positions.size());
    return sum / static_cast<double>(source.size());
}

// Means over at most five frames, evenly spread.
Result<FactList> capture_facts(const Options& options, const SourceFrames& source, Findings& findings) {
    double triangles = 0, components = 0, boundary = 0, non_manifold = 0, looked_at = 0;
    TopologyMeasureOptions topology_options;
    topology_options.defects = false;
    findings.has_colour = true;
    const std::size_t every = measure_every(source.size(), 5);
    const ThreadPool pool(options.threads);
    for (std::size_t i = 0; i < source.size(); i += every) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        const auto counted = topology((*frame)->mesh, topology_options, pool.threads());
        if (!counted) return tl::unexpected(counted.error());
        findings.has_colour = findings.has_colour && !(*frame)->mesh.colours.empty();
        triangles += static_cast<double>(counted->triangles);
        components += static_cast<double>(counted->components);
        boundary += static_cast<double>(counted->boundary_edges);
        non_manifold += static_cast<double>(counted->non_manifold_edges);
        ++looked_at;
    }
    const auto& facts = source.facts();
    const auto size = facts.box.high - facts.box.low;
    FactList out{{"Frames", fmt::format("{}, {:g} per second", source.size(), facts.fps)},
                 {"Vertices", fmt::format("{:.0f} per frame on average", mean_vertices(source))},
                 {"Triangles", fmt::format("{:.0f}", triangles / looked_at)},
                 {"Pieces", fmt::format("{:.1f} per frame", components / looked_at)},
                 {"Boundary edges", fmt::format("{:.1f} per frame", boundary / looked_at)},
                 {"Non-manifold edges", fmt::format("{:.1f} per frame", non_manifold / looked_at)},
                 {"Colours", findings.has_colour ? "at the vertices" : "none"},
                 {"Box around all frames", fmt::format("{:.0f} x {:.0f} x {:.0f} mm", size[0], size[1], size[2])},
                 {"Skeleton", facts.skeleton.bones.empty()
                                  ? std::string("none: one bone that spans the mesh stands in")
                                  : fmt::format("{} joints, {} bones", facts.skeleton.joint_names.size(),
                                                facts.skeleton.bones.size())},
                 {"I-frames", fmt::format("one in {}", options.key_interval)}};
    return out;
}

Result<Report> make_report(const Options& options, const Laboratory& laboratory, const ExperimentPlan& plan,
                           const FactList& facts, Findings& findings) {
    const auto wanted = wanted_figures(options);
    const auto& source = *laboratory.source;
    Easel easel{path(options.output) / "figures", {}};
    Report report;
    report.figures = chart_figures(findings, plan, wanted, easel);
    if (auto drawn = run_gnuplot(easel.script, easel.folder / "figures.gp"); !drawn)
        return tl::unexpected(drawn.error());
    note("drawing frames");
    GalleryOptions gallery_options{easel.folder, options.azimuth, options.key_interval, plan.picture_colour_step,
                                   laboratory.threads};
    auto gallery = picture_figures(source, findings, wanted, gallery_options);
    if (!gallery) return tl::unexpected(gallery.error());
    std::move(gallery->figures.begin(), gallery->figures.end(), std::back_inserter(report.figures));
    auto motion = motion_pictures(source, plan, wanted, gallery_options, findings);
    if (!motion) return tl::unexpected(motion.error());
    std::move(motion->begin(), motion->end(), std::back_inserter(report.figures));
    std::stable_sort(report.figures.begin(), report.figures.end(), [](const Figure& a, const Figure& b) {
        return std::atoi(a.number.c_str()) < std::atoi(b.number.c_str());
    });
    report.opening = std::move(gallery->opening);
    report.opening_caption = gallery->opening_caption;
    const auto name = capture_name(options);
    report.title = "The paper's experiments on " + name;
    report.subtitle = fmt::format("{} frames of {:.0f} vertices, {:g} per second. htvm {}", source.size(),
                                  mean_vertices(source), source.facts().fps, HTVM_VERSION);
    report.claims = claims(findings);
    report.summary = summary_paragraphs(
        fmt::format("{} frames of {}, {:.0f} vertices each,", source.size(), name, mean_vertices(source)), findings,
        report.claims);
    report.tables = result_tables(findings);
    report.capture = facts;
    report.machine = machine_facts(laboratory.threads);
    report.commands = {own_command(), fmt::format("gnuplot {}", (easel.folder / "figures.gp").string())};
    return report;
}

Result<void> write_report(const Options& options, const Report& report, const Findings& findings) {
    const path folder(options.output);
    const auto page = report_page(report);
    if (!page) return tl::unexpected(page.error());
    if (auto ok = write_text(folder / "report.html", *page); !ok) return ok;
    if (auto ok = write_text(folder / "reproduce.json", report_json(report, findings).dump(1) + "\n"); !ok) return ok;
    for (const auto& paragraph : report.summary) fmt::print("{}\n", paragraph);
    for (const auto& claim : report.claims)
        fmt::print("  {:<46} {:<38} {} ({})\n", claim.what, claim.paper, claim.here, claim.verdict);
    std::fflush(stdout);
    note(fmt::format("{}: the report, {:.1f} MB; the numbers are in reproduce.json", (folder / "report.html").string(),
                     static_cast<double>(page->size()) / 1e6));
    return {};
}

Result<void> reproduce(Options options) {
    if (is_piped(options.capture))
        return fail(ErrorKind::bad_input, "results are kept by the files they came from: give files, not -");
    if (std::system("command -v gnuplot >/dev/null 2>&1") != 0)
        return fail(ErrorKind::unsupported,
                    "gnuplot, which draws the figures, is not installed (Debian: apt install gnuplot-nox)");
    if (options.quick && options.capture.frames == 0) options.capture.frames = 10;
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    const WorkFolder work(path(options.output) / "work");
    if (auto made = make_folder(work.where); !made) return made;
    SourceOptions source_options;
    source_options.memory_bytes = options.memory_megabytes << 20;
    source_options.spill_folder = work.where;
    const auto source = SourceFrames::load(*capture, source_options);
    if (!source) return tl::unexpected(source.error());
    const auto laboratory = laboratory_of(options, *source);
    if (!laboratory) return tl::unexpected(laboratory.error());
    Findings findings;
    const auto facts = capture_facts(options, *source, findings);
    if (!facts) return tl::unexpected(facts.error());
    const auto plan = plan_of(options);
    const auto wanted = wanted_figures(options);
    if (auto ok = measure_internals(options, *laboratory, wanted, findings); !ok) return ok;
    if (auto ok = measure_curves(options, *laboratory, plan, wanted, findings); !ok) return ok;
    const auto report = make_report(options, *laboratory, plan, *facts, findings);
    if (!report) return tl::unexpected(report.error());
    return write_report(options, *report, findings);
}

}  // namespace

void add_reproduce(CLI::App& app, app::Run& run) {
    auto* command = app.add_subcommand(
        "reproduce", "The paper's experiments on a capture: figures, tables and one HTML page to look at");
    const auto options = std::make_shared<Options>();
    Options& o = *options;
    add_capture_options(*command, o.capture);
    command->add_option("-o,--output", o.output, "Folder for report.html, figures and kept results")
        ->type_name("FOLDER")
        ->required();
    command->add_option("--figures", o.figures, "Figures of the paper from 6 to 25, separated by commas (default: all)")
        ->delimiter(',')
        ->check(CLI::Range(6, 25))
        ->option_text("LIST");
    command->add_flag("--quick", o.quick,
                      "A small report within a minute or two: 10 frames unless --frames says another number, fewer\n"
                      "qualities, figures 6 to 8, 10, 17 to 19 and 21 to 25 unless --figures names others");
    command->add_option("--title", o.title, "The capture's name in the report (default: the folder's)");
    command->add_option("--keyint", o.key_interval, "Frames from one I-frame to the next (default 30)")
        ->check(CLI::Range(1, 1000000));
    command
        ->add_option("--true-skeleton", o.true_skeleton,
                     "For figure 20, the skeleton without tracking noise (default: skeleton_true.json next to\n"
                     "skeleton.json if it exists, else noise is added to the tracked skeleton)")
        ->type_name("FILE");
    command->add_option("--azimuth", o.azimuth,
                        "Degrees about the vertical from which frames are drawn; 0 looks along -z (default: the\n"
                        "body's front, as far as it can be determined)");
    command->add_option("--threads", o.threads, "0: one per core")->check(CLI::Range(0, 1024));
    command->add_option("--memory", o.memory_megabytes, "MB of frames to hold in memory (default 1024)")
        ->check(CLI::Range(1, 1 << 20));
    command->footer(
        "Measurements are kept in OUTPUT/results: if you run it again with more figures, only these take time.\n"
        "Needs gnuplot (Debian: gnuplot-nox).");
    command->callback([&run, options] { run = [options] { return reproduce(*options); }; });
}

}  // namespace htvm::lab
