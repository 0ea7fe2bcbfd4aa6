// htvm-lab hierarchy: what an I-frame takes beside a base mesh with levels of displacements, at equal error.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "codec/encoder/leveled_intra.h"
#include "codec/format/sequence.h"
#include "codec/intra/intra_frame.h"
#include "coders.h"
#include "command_line/capture.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/lattice.h"
#include "htvm/encoder.hpp"
#include "metrics/surface_error.h"

namespace htvm::lab {

using namespace app;
using namespace internal;
namespace {

constexpr std::size_t layer_overhead = 3;  // the layer's number and length

struct Options {
    CaptureOptions capture;
    std::vector<std::size_t> at{0};
    std::vector<double> qualities{20, 30, 40, 50, 60, 70, 80, 90, 100};
    std::vector<double> steps{0.75, 1, 1.4, 2, 2.6, 3.5};  // mm
    std::vector<double> errors{0.4, 0.8};                  // mm
    std::uint64_t samples = 200000;
    LeveledIntraOptions levels;
    bool json = false;
};

// One way to code a frame, and what it takes and leaves.
struct Point {
    std::string setting;
    std::size_t bytes = 0, vertices = 0;
    SurfaceError error;
    // Where there is a base with levels:
    std::size_t base_vertices = 0, connectivity = 0, base_positions = 0;
    std::vector<EncodedSurfaceLevels::Part> parts = {};
    double encode_ms = 0;
    // Of what shows the base's displacements, then of what shows each level as well.
    struct Shown {
        std::size_t bytes = 0;
        double decode_ms = 0;  // the median
    };
    std::vector<Shown> shown = {};
};

// The processor's time, which others on the machine do not change; all here runs on one thread.
double milliseconds_since(std::clock_t begin) {
    return 1000 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

// What it takes to show the first levels: of the I-frame's payload with the base, and of the runs of these levels.
Result<Point::Shown> shown_down_to(const LeveledIntra& coded, std::uint32_t level) {
    constexpr std::size_t times = 31;
    const auto header = read_levels_header(coded.levels.payload);
    if (!header) return tl::unexpected(header.error());
    const auto runs = std::span(coded.levels.payload).first(header->ends[std::min(level, header->levels.depth.levels)]);
    std::vector<double> taken;
    for (std::size_t i = 0; i < times; ++i) {
        const auto begin = std::clock();
        const auto base = decode_intra_frame(view_of(coded.base), nullptr);
        if (!base) return tl::unexpected(base.error());
        const auto surface = decode_surface_levels(runs, *base, coded.levels.surface.positions.size(), level);
        if (!surface) return tl::unexpected(surface.error());
        taken.push_back(milliseconds_since(begin));
    }
    std::nth_element(taken.begin(), taken.begin() + times / 2, taken.end());
    return Point::Shown{write_frame_payload(coded.base).size() + layer_overhead + runs.size() + packet_overhead,
                        taken[times / 2]};
}

Result<Point> measured(Point point, const Mesh& captured, const Mesh& shown, const Options& options) {
    SurfaceErrorOptions how;
    how.samples = options.samples;
    auto error = surface_error(captured, shown, how);
    if (!error) return tl::unexpected(error.error());
    point.error = *error;
    return point;
}

// As htvm encode makes an I-frame, noise and all.
Result<Point> intra_point(const Mesh& mesh, double quality, const Options& options) {
    EncoderOptions settings = default_options(Profile::tracked);
    settings.tracked.denoise = Denoising::off;
    settings.geometry_step = quality_point(quality).geometry_step;
    auto encoder = Encoder::create(settings);
    if (!encoder) return tl::unexpected(encoder.error());
    if (auto ok = encoder->push(mesh, nullptr, 0, true); !ok) return tl::unexpected(ok.error());
    if (auto ok = encoder->finish(); !ok) return tl::unexpected(ok.error());
    Point out;
    out.setting = fmt::format("-q {:g}", quality);
    out.bytes = encoder->last_frame().bytes.total();
    out.vertices = encoder->last_frame().vertices;
    return measured(std::move(out), mesh, encoder->reconstruction(), options);
}

Result<Point> leveled_point(const Mesh& mesh, double step, const Options& options) {
    Lattice lattice;
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    lattice.origin = *origin;
    const auto captured = to_lattice(mesh, lattice);
    if (!captured) return tl::unexpected(captured.error());
    auto settings = options.levels;
    settings.step = LatticeUnits(step / lattice.step());
    const auto begin = std::clock();
    const auto coded = encode_leveled_intra(*captured, settings);
    const double encode_ms = milliseconds_since(begin);
    if (!coded) return tl::unexpected(coded.error());
    const auto& levels = coded->levels;
    const auto again = decode_surface_levels(levels.payload, coded->decoded_base, levels.surface.positions.size());
    if (!again) return tl::unexpected(again.error());
    if (again->positions != levels.surface.positions || again->finest() != levels.surface.finest())
        return fail(ErrorKind::corrupt_stream, "what is decoded is not what was encoded");
    Point out;
    out.setting = fmt::format("step {:g}", step);
    out.bytes = write_frame_payload(coded->base).size() + layer_overhead + levels.payload.size() + packet_overhead;
    out.vertices = levels.surface.positions.size();
    out.base_vertices = coded->decoded_base.positions.size();
    out.connectivity = coded->base.of(Layer::fans).size();
    out.base_positions = coded->base.of(Layer::geometry).size();
    out.parts = levels.parts;
    out.encode_ms = encode_ms;
    for (std::uint32_t k = 0; k < levels.parts.size(); ++k) {
        auto shown = shown_down_to(*coded, k);
        if (!shown) return tl::unexpected(shown.error());
        out.shown.push_back(*shown);
    }
    LatticeMesh shown;
    shown.positions = levels.surface.positions;
    shown.triangles = levels.surface.finest();
    return measured(std::move(out), mesh, to_mesh(shown, lattice), options);
}

// The bytes at which an error is reached, between neighbouring points on logarithmic scales; 0 where none is that good
// or that bad.
double bytes_at(std::vector<Point> points, double error) {
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return m2(a.error) < m2(b.error); });
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const double below = m2(points[i].error), above = m2(points[i + 1].error);
        if (!(below <= error && error <= above)) continue;
        const double share = above > below ? std::log(error / below) / std::log(above / below) : 0;
        return std::exp(std::log(static_cast<double>(points[i].bytes)) * (1 - share) +
                        std::log(static_cast<double>(points[i + 1].bytes)) * share);
    }
    return 0;
}

nlohmann::json json_of(const Point& p) {
    nlohmann::json out = {{"setting", p.setting},
                          {"bytes", p.bytes},
                          {"vertices", p.vertices},
                          {"m2_mm", m2(p.error)},
                          {"forward_mm", p.error.forward.rms},
                          {"backward_mm", p.error.backward.rms}};
    if (p.parts.empty()) return out;
    out["base_vertices"] = p.base_vertices;
    out["connectivity_bytes"] = p.connectivity;
    out["base_position_bytes"] = p.base_positions;
    for (const auto& part : p.parts)
        out["levels"].push_back({{"vertices", part.vertices}, {"moved", part.moved}, {"bytes", part.bytes}});
    out["encode_ms"] = p.encode_ms;
    for (const auto& shown : p.shown) out["shown"].push_back({{"bytes", shown.bytes}, {"decode_ms", shown.decode_ms}});
    return out;
}

void print(const Point& p) {
    fmt::print("{:12}{:>8}{:>9}{:>8.3f}{:>9.3f}{:>9.3f}", p.setting, p.bytes, p.vertices, m2(p.error),
               p.error.forward.rms, p.error.backward.rms);
    if (!p.parts.empty()) fmt::print("{:>8}{:>7}{:>7}", p.base_vertices, p.connectivity, p.base_positions);
    for (const auto& part : p.parts)
        fmt::print("{:>7} {:<6}", part.bytes,
                   fmt::format("({:.0f}%)", 100 * static_cast<double>(part.moved) /
                                                static_cast<double>(std::max<std::size_t>(part.vertices, 1))));
    if (!p.shown.empty()) fmt::print("\n{:12}encoded in {:.0f} ms; shown down to each level:", "", p.encode_ms);
    for (const auto& shown : p.shown) fmt::print("  {} bytes in {:.2f} ms", shown.bytes, shown.decode_ms);
    fmt::print("\n");
    std::fflush(stdout);
}

Result<nlohmann::json> measure_frame(Mesh mesh, std::size_t number, const Options& options) {
    mesh.colours.clear();
    mesh.normals.clear();
    mesh.texcoords.clear();
    if (!options.json)
        fmt::print("\nframe {}\n\n{:12}{:>8}{:>9}{:>8}{:>9}{:>9}{:>8}{:>7}{:>7}  displacements (share that moves)\n",
                   number, "", "bytes", "vertices", "M2, mm", "forward", "backward", "base", "fans", "places");
    std::vector<Point> today, leveled;
    for (const double quality : options.qualities) {
        auto point = intra_point(mesh, quality, options);
        if (!point) return tl::unexpected(point.error());
        if (!options.json) print(*point);
        today.push_back(std::move(*point));
    }
    for (const double step : options.steps) {
        auto point = leveled_point(mesh, step, options);
        if (!point) return tl::unexpected(point.error());
        if (!options.json) print(*point);
        leveled.push_back(std::move(*point));
    }
    nlohmann::json out = {{"frame", number}};
    for (const auto& p : today) out["intra"].push_back(json_of(p));
    for (const auto& p : leveled) out["leveled"].push_back(json_of(p));
    for (const double error : options.errors) {
        const double before = bytes_at(today, error), now = bytes_at(leveled, error);
        const bool known = before > 0 && now > 0;
        if (!options.json)
            fmt::print("M2 {:g} mm: {}\n", error,
                       known ? fmt::format("{:.0f} bytes for {:.0f}, ratio {:.3f}", now, before, now / before)
                             : "not between two points of each");
        if (known)
            out["at"].push_back(
                {{"m2_mm", error}, {"intra_bytes", before}, {"leveled_bytes", now}, {"ratio", now / before}});
    }
    return out;
}

Result<void> run_hierarchy(const Options& options) {
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    auto frames = nlohmann::json::array();
    const auto last = std::max_element(options.at.begin(), options.at.end());
    for (std::size_t number = 0; last != options.at.end() && number <= *last; ++number) {
        auto next = capture->next();
        if (!next) return tl::unexpected(next.error());
        if (!*next) break;
        if (std::find(options.at.begin(), options.at.end(), number) == options.at.end()) continue;
        auto frame = measure_frame(std::move(**next), number, options);
        if (!frame) return tl::unexpected(frame.error());
        frames.push_back(std::move(*frame));
    }
    if (frames.empty()) return fail(ErrorKind::bad_input, "the capture has none of these frames");
    if (options.json)
        fmt::print("{}\n", nlohmann::json{{"program", "htvm-lab " HTVM_VERSION},
                                          {"input", input_name(options.capture)},
                                          {"frames", std::move(frames)}}
                               .dump(1));
    return {};
}

}  // namespace

void add_hierarchy(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand(
        "hierarchy", "What a base mesh with levels of displacements takes beside an I-frame, at equal error");
    add_capture_options(*command, options->capture);
    auto& levels = options->levels;
    command->add_option("--at", options->at, "Frames to measure, separated by commas (default 0, the first)")
        ->delimiter(',');
    command->add_option("-q,--quality", options->qualities, "Qualities of the I-frames (default 20,30,...,100)")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 100.0));
    command
        ->add_option("--steps", options->steps, "Steps of the finest displacements, mm (default 0.75,1,1.4,2,2.6,3.5)")
        ->delimiter(',')
        ->check(CLI::Range(0.01, 100.0));
    command->add_option("--errors", options->errors, "Errors (M2, mm) at which bytes are compared (default 0.4,0.8)")
        ->delimiter(',');
    command->add_option("--samples", options->samples, "Samples of M2 in each direction (default 200000)");
    command->add_option("--levels", levels.levels, "Levels below the base that are coded (default 2)")
        ->check(CLI::Range(0u, most_levels));
    command->add_option("--base-error", levels.base_error, "Error of the base, in steps (default 2.4)")
        ->check(CLI::Range(0.01, 100.0));
    command->add_option("--base-step", levels.base_step, "Step of the base's positions, in steps (default 4.4)")
        ->check(CLI::Range(0.01, 100.0));
    command
        ->add_option("--base-again", levels.base_again,
                     "How often the base is made finer where much is left (default 1)")
        ->check(CLI::Range(0, 10));
    command
        ->add_option("--longest-edge", levels.longest_edge,
                     "Longest edge of the finest coded level, in steps (default 9.9)")
        ->check(CLI::Range(0.01, 1000.0));
    command->add_option("--coarser", levels.coarser, "A level's step in sixteenths of that below (default 12)")
        ->check(CLI::Range(1u, 16u));
    command
        ->add_option("--rounded", levels.rounded,
                     "Bend from which the level behind those that are coded splits an edge, in steps (default 0.19; 0: "
                     "no such level)")
        ->check(CLI::Range(0.0, 7.9));
    command->add_option("--butterfly", levels.rule.butterfly, "Eighths of the butterfly rule (default 2)")
        ->check(CLI::Range(0u, 15u));
    command->add_option("--tangents", levels.rule.tangents, "Eighths of the tangent planes' rule (default 8)")
        ->check(CLI::Range(0u, 15u));
    command->add_option("--lambda", levels.lambda, "Squared steps that a bit must spare (default 0.107)");
    command->add_option("--least-moved", levels.least_moved, "Least displacement, in steps (default 0.93)");
    command->add_flag("--json", options->json, "Print the result as JSON on standard output");
    command->footer(
        "Geometry alone, without the noise filter. One step says how fine everything is. Displacements are those of\n"
        "the base and of each level, in bytes, and the share of vertices that they move. Below: the processor's time "
        "of encoding,\n"
        "and the bytes and median time of decoding the base alone, then with one level, with two and so on.\n\n"
        "Example:\n"
        "  htvm-lab hierarchy capture/ --at 0,30 -q 30,40,50,60");
    command->callback([options, &run] { run = [options] { return run_hierarchy(*options); }; });
}

}  // namespace htvm::lab
