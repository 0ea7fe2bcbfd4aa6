// htvm-lab hierarchy: what I-frames take beside a base mesh with levels of displacements, at equal error.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "codec/encoder/surface_levels.h"
#include "codec/encoder/tracked/captured_surface.h"
#include "codec/format/sequence.h"
#include "codec/intra/intra_frame.h"
#include "command_line/capture.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "coders.h"
#include "core/lattice.h"
#include "htvm/encoder.hpp"
#include "metrics/surface_error.h"
#include "surface/simplification.h"

namespace htvm::lab {

using namespace app;
using namespace internal;
namespace {

struct Options {
    CaptureOptions capture;
    std::vector<std::size_t> frames{0};
    std::vector<double> qualities{20, 30, 40, 50, 60, 70, 80, 90, 100};
    std::vector<double> base_errors{3};   // mm
    std::vector<double> base_steps{6};    // mm
    std::vector<double> steps{1};         // mm
    std::vector<double> edges{10};        // mm
    std::uint32_t levels = 3, coarser = 12;
    double lambda = 0.06, least_moved = 0.7;
    int rounds = 5, choices = 3, iterations = 6;
    int refined = 1;
    double outlier = 3;
    double back = 1, farthest = 0.5, last_reach = 6;
    float agreement = 0.6F;
    std::uint32_t butterfly = 0, tangents = 10;
    bool json = false;
};

struct Point {
    std::string setting;
    std::size_t bytes = 0, vertices = 0;
    double m2 = 0, forward = 0, backward = 0;
    std::string detail;
};

constexpr std::uint64_t samples = 200000;

Result<Point> intra_point(const Mesh& mesh, double quality) {
    EncoderOptions options = default_options(Profile::tracked);
    options.tracked.denoise = Denoising::off;
    options.geometry_step = quality_point(quality).geometry_step;
    auto encoder = Encoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    if (auto ok = encoder->push(mesh, nullptr, 0, true); !ok) return tl::unexpected(ok.error());
    if (auto ok = encoder->finish(); !ok) return tl::unexpected(ok.error());
    Point out;
    out.setting = fmt::format("q{:g}", quality);
    out.bytes = encoder->last_frame().bytes.total();
    out.vertices = encoder->last_frame().vertices;
    const auto error = surface_error(mesh, encoder->reconstruction(), {.samples = samples});
    if (!error) return tl::unexpected(error.error());
    out.forward = error->forward.rms;
    out.backward = error->backward.rms;
    out.m2 = m2(*error);
    return out;
}

LatticeMesh base_mesh(const LatticeMesh& welded_mesh, double error, std::span<const float> finer) {
    std::vector<Eigen::Vector3d> points;
    for (const auto p : welded_mesh.positions) points.emplace_back(p.x, p.y, p.z);
    SimplificationOptions options;
    options.surface_error = error;
    options.finer = finer;
    const auto simplified = simplify(points, welded_mesh.triangles, {}, options);
    LatticeMesh out;
    for (const auto& p : simplified.positions)
        out.positions.push_back({within_lattice(std::llround(p.x())), within_lattice(std::llround(p.y())),
                                 within_lattice(std::llround(p.z()))});
    out.triangles = simplified.triangles;
    return out;
}

Result<Point> levels_point(const Mesh& mesh, const Lattice& lattice, const LatticeMesh& base,
                           const SurfaceIndex& captured, double base_step, const SurfaceLevelsOptions& options) {
    FramePayload payload;
    IntraFrameOptions intra;
    intra.geometry_step = std::max(1, static_cast<std::int32_t>(std::lround(base_step * 16)));
    intra.merge_duplicates = false;
    const auto decoded = encode_intra_frame(base, intra, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    const auto coded = encode_surface_levels(captured, *decoded, options);
    const auto again = decode_surface_levels(coded.run, *decoded, std::size_t{1} << 24);
    if (!again) return tl::unexpected(again.error());
    if (again->positions != coded.surface.positions || again->triangles != coded.surface.triangles)
        return fail(ErrorKind::corrupt_stream, "what was decoded is not what was encoded");
    Point out;
    const std::size_t base_bytes = write_frame_payload(payload).size();
    out.bytes = base_bytes + coded.run.size() + 2 + packet_overhead;
    out.vertices = coded.surface.positions.size();
    LatticeMesh shown;
    shown.positions = coded.surface.positions;
    shown.triangles = coded.surface.triangles;
    const auto error = surface_error(mesh, to_mesh(shown, lattice), {.samples = samples});
    if (!error) return tl::unexpected(error.error());
    out.forward = error->forward.rms;
    out.backward = error->backward.rms;
    out.m2 = m2(*error);
    out.detail = fmt::format("base {} v, fans {} geo {};", decoded->positions.size(), payload.of(Layer::fans).size(),
                             payload.of(Layer::geometry).size());
    {
        const SurfaceIndex decoded_index(points_of(shown.positions), shown.triangles);
        double all = 0, two = 0, four = 0;
        std::size_t n2 = 0;
        for (const auto& p : captured.positions) {
            const double d = decoded_index.closest(p).squared_distance / 256.0;
            all += d;
            if (d > 4) two += d, ++n2;
            if (d > 16) four += d;
            if (d > 9 && std::getenv("WHERE")) fmt::print("F {} {} {} {:.1f}\n", p[0]/16, p[1]/16, p[2]/16, std::sqrt(d));
        }
        out.detail += fmt::format(" [>2mm {:.2f} ({:.4f} of v) >4mm {:.2f}]", two / all, static_cast<double>(n2) / static_cast<double>(captured.positions.size()), four / all);
    }
    {
        double all = 0, two = 0, four = 0;
        std::size_t n2 = 0;
        for (std::size_t v = 0; v < shown.positions.size(); ++v) {
            const double d = captured.closest(point_of(shown.positions[v])).squared_distance / 256.0;
            all += d;
            if (d > 4) two += d, ++n2;
            if (d > 16) four += d;
            if (d > 16 && std::getenv("WHERE")) {
                std::size_t level = 0, end = 0;
                for (; level < coded.parts.size(); ++level) if (v < (end += coded.parts[level].vertices)) break;
                fmt::print("v {} level {} at {} {} {} off {:.1f}\n", v, level, shown.positions[v].x/16, shown.positions[v].y/16, shown.positions[v].z/16, std::sqrt(d));
            }
        }
        out.detail += fmt::format(" back[>2mm {:.2f} ({}) >4mm {:.2f}]", two / all, n2, four / all);
    }
    for (const auto& part : coded.parts)
        out.detail += fmt::format(" {}/{}:{:.0f}", part.moved, part.vertices, part.bytes);
    return out;
}

double bytes_at(std::vector<Point> points, double m2) {
    // The lower hull in (log m2, log bytes).
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.m2 < b.m2; });
    double best = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            if (!(points[i].m2 <= m2 && m2 <= points[j].m2)) continue;
            const double x0 = std::log(points[i].m2), x1 = std::log(points[j].m2);
            const double y0 = std::log(static_cast<double>(points[i].bytes)),
                         y1 = std::log(static_cast<double>(points[j].bytes));
            const double t = x1 > x0 ? (std::log(m2) - x0) / (x1 - x0) : 0;
            const double bytes = std::exp(y0 + t * (y1 - y0));
            if (best == 0 || bytes < best) best = bytes;
        }
    return best;
}

void print(const Point& p) {
    fmt::print("{:34} {:>7} B {:>7} v  M2 {:.3f} ({:.3f} {:.3f})  {}\n", p.setting, p.bytes, p.vertices, p.m2,
               p.forward, p.backward, p.detail);
    std::fflush(stdout);
}

Result<void> run_hierarchy(const Options& options) {
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    std::size_t number = 0;
    while (true) {
        auto next = capture->next();
        if (!next) return tl::unexpected(next.error());
        if (!*next) break;
        if (std::find(options.frames.begin(), options.frames.end(), number++) == options.frames.end()) continue;
        Mesh mesh = std::move(**next);
        mesh.colours.clear();
        mesh.normals.clear();
        mesh.texcoords.clear();
        std::vector<Point> today, levelled;
        for (const double q : options.qualities) {
            auto point = intra_point(mesh, q);
            if (!point) return tl::unexpected(point.error());
            print(*point);
            today.push_back(std::move(*point));
        }
        Lattice lattice;
        const auto origin = lattice_origin(mesh);
        if (!origin) return tl::unexpected(origin.error());
        lattice.origin = *origin;
        const auto whole = to_lattice(mesh, lattice);
        if (!whole) return tl::unexpected(whole.error());
        const auto surface_mesh = welded(*whole, at_same_place(*whole));
        const auto captured = evenly_sampled(surface_mesh, {});
        for (const double error : options.base_errors) {
            auto base = base_mesh(surface_mesh, 16 * error, {});
            std::vector<float> finer(surface_mesh.positions.size(), 1);
            for (int again = 0; again < options.refined; ++again) {
                SurfaceLevels fitted;
                fitted.depth = {options.levels, static_cast<std::uint32_t>(std::lround(16 * options.edges.front()))};
                fitted.step = static_cast<std::uint32_t>(std::lround(256 * options.steps.front()));
                fitted.rules.fill({options.butterfly, options.tangents});
                const auto subdivision = subdivide(base, fitted.depth, std::size_t{1} << 24);
                SurfaceFitOptions fit_options;
                SurfaceFit fit(captured, base, *subdivision, fitted, fit_options);
                fit.improve(0, 4);
                const auto shown = fit.surface();
                const SurfaceIndex index(points_of(shown), subdivision->back().triangles);
                std::vector<double> distance;
                double sum = 0;
                for (const auto& p : surface_mesh.positions) {
                    distance.push_back(index.closest(point_of(p)).squared_distance);
                    sum += distance.back();
                }
                const double usual = options.outlier * std::sqrt(sum / static_cast<double>(distance.size()));
                const auto around = vertices_around(surface_mesh.positions.size(), surface_mesh.triangles);
                std::vector<float> own;
                for (const double d : distance)
                    own.push_back(static_cast<float>(std::clamp(std::sqrt(d) / usual, 1.0, 3.0)));
                for (int ring = 0; ring < 2; ++ring) {
                    auto wider = own;
                    for (std::size_t v = 0; v < own.size(); ++v)
                        for (const auto other : around.of(v)) wider[v] = std::max(wider[v], own[other]);
                    own = std::move(wider);
                }
                for (std::size_t v = 0; v < own.size(); ++v) finer[v] *= own[v];
                base = base_mesh(surface_mesh, 16 * error, finer);
            }
            for (const double base_step : options.base_steps)
                for (const double finest : options.edges)
                    for (const double step : options.steps) {
                        SurfaceLevelsOptions chosen;
                        chosen.levels.depth.levels = options.levels;
                        chosen.levels.coarser = options.coarser;
                        chosen.levels.step = static_cast<std::uint32_t>(std::lround(256 * step));
                        chosen.levels.depth.longest_edge = static_cast<std::uint32_t>(std::lround(16 * finest));
                        chosen.lambda = options.lambda;
                        chosen.levels.rules.fill({options.butterfly, options.tangents});
                        chosen.fit.least_moved = options.least_moved;
                        chosen.rounds = options.rounds;
                        chosen.fit.last_reach = LatticeUnits(16 * options.last_reach);
                        chosen.fit.farthest = options.farthest;
                        chosen.fit.agreement = options.agreement;
                        chosen.fit.back = options.back;
                        chosen.fit.choices = options.choices;
                        chosen.fit.iterations = options.iterations;
                        auto point = levels_point(mesh, lattice, base, captured, base_step, chosen);
                        if (!point) return tl::unexpected(point.error());
                        point->setting = fmt::format("base {:g}/{:g} edge {:g} step {:g}", error, base_step, finest, step);
                        print(*point);
                        levelled.push_back(std::move(*point));
                    }
        }
        for (const double at : {0.4, 0.8}) {
            const double a = bytes_at(today, at), b = bytes_at(levelled, at);
            fmt::print("M2 {:.1f}: today {:.0f}, levels {:.0f}, ratio {:.3f}\n", at, a, b, a > 0 ? b / a : 0);
        }
    }
    return {};
}

}  // namespace

void add_hierarchy(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("hierarchy", "I-frames beside a base mesh with levels of displacements");
    add_capture_options(*command, options->capture);
    command->add_option("--at", options->frames, "Frames")->delimiter(',');
    command->add_option("-q,--quality", options->qualities, "Qualities of I-frames")->delimiter(',');
    command->add_option("--base-errors", options->base_errors, "mm")->delimiter(',');
    command->add_option("--base-steps", options->base_steps, "mm")->delimiter(',');
    command->add_option("--steps", options->steps, "mm")->delimiter(',');
    command->add_option("--edges", options->edges, "mm")->delimiter(',');
    command->add_option("--levels", options->levels, "");
    command->add_option("--coarser", options->coarser, "");
    command->add_option("--rounds", options->rounds, "");
    command->add_option("--least-moved", options->least_moved, "");
    command->add_option("--back", options->back, "");
    command->add_option("--choices", options->choices, "");
    command->add_option("--iterations", options->iterations, "");
    command->add_option("--farthest", options->farthest, "");
    command->add_option("--last-reach", options->last_reach, "");
    command->add_option("--agreement", options->agreement, "");
    command->add_option("--refined", options->refined, "");
    command->add_option("--outlier", options->outlier, "");
    command->add_option("--lambda", options->lambda, "");
    command->add_option("--butterfly", options->butterfly, "");
    command->add_option("--tangents", options->tangents, "");
    command->callback([options, &run] { run = [options] { return run_hierarchy(*options); }; });
}

}  // namespace htvm::lab
