// htvm-lab endure: minutes of synthetic motion, and whether anything grows with time.
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "charts.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "endurance.h"
#include "metrics/drift.h"
#include "metrics/surface_error.h"
#include "sweep.h"
#include "synthetic_stream.h"

namespace htvm::lab {

using namespace app;
namespace {

constexpr double row_seconds = 10;

struct Options {
    SyntheticOptions stream;
    double minutes = 5;
    int measure_every = 10;
    std::size_t marks = 400;
    std::string output;
    bool json = false;
};

std::size_t resident_now() {
    std::ifstream file("/proc/self/statm");
    std::stringstream text;
    text << file.rdbuf();
    return resident_bytes(text.str(), static_cast<std::size_t>(std::max(sysconf(_SC_PAGESIZE), 1L)));
}

// The sums of a row that is not complete.
struct RowSums {
    EnduranceRow row;
    std::size_t frames = 0, bytes = 0, measured = 0, drifting = 0;
    double squared = 0, drift = 0, p95 = 0, patches = 0;
};

EnduranceRow finished(const RowSums& sums, double fps) {
    EnduranceRow out = sums.row;
    const auto frames = static_cast<double>(std::max<std::size_t>(sums.frames, 1));
    const auto drifting = static_cast<double>(std::max<std::size_t>(sums.drifting, 1));
    out.until_s = out.from_s + static_cast<double>(sums.frames) / fps;
    out.megabits = 8e-6 * static_cast<double>(sums.bytes) * fps / frames;
    out.m2_mm = std::sqrt(sums.squared / static_cast<double>(std::max<std::size_t>(sums.measured, 1)));
    out.drift_mm = sums.drift / drifting;
    out.drift_p95_mm = sums.p95 / drifting;
    out.patches = sums.patches / frames;
    out.resident_mb = static_cast<double>(resident_now()) / 1e6;
    return out;
}

// A mesh as DriftMeter takes it.
Mesh marks_mesh(const TrueFrame& truth) {
    Mesh out;
    out.positions = truth.positions;
    out.normals = truth.normals;
    return out;
}

void print_head() {
    fmt::print("{:>8}{:>6}{:>6}{:>6}{:>8}{:>9}{:>8}{:>10}{:>10}{:>9}{:>9}\n", "until", "I", "T", "TP", "renewed",
               "Mbit/s", "M2", "drift", "95 %", "patches", "MB");
}

void print_row(const EnduranceRow& row) {
    const auto of = [&](FrameType type) { return row.frames[static_cast<std::size_t>(type)]; };
    fmt::print("{:>4}:{:02}{:>7}{:>6}{:>6}{:>8}{:>9.3f}{:>8.3f}{:>10.3f}{:>10.3f}{:>9.1f}{:>9.1f}\n",
               static_cast<int>(row.until_s) / 60, static_cast<int>(row.until_s) % 60, of(FrameType::intra),
               of(FrameType::tracked), of(FrameType::patched), row.renewals, row.megabits, row.m2_mm, row.drift_mm,
               row.drift_p95_mm, row.patches, row.resident_mb);
    std::fflush(stdout);
}

Result<std::vector<EnduranceRow>> measure(const Options& options) {
    const double fps = options.stream.synth.fps;
    auto stream = SyntheticStream::start(options.stream, surface_marks(options.stream.synth, options.marks));
    if (!stream) return tl::unexpected(stream.error());
    const auto frames = static_cast<std::size_t>(std::llround(options.minutes * 60 * fps));
    const auto frames_in_row = static_cast<std::size_t>(std::max(1.0, std::round(row_seconds * fps)));
    const internal::ThreadPool pool(options.stream.threads);
    SurfaceErrorOptions surface_options;
    surface_options.samples = 10000;
    surface_options.threads = pool.threads();
    DriftMeter drift;
    std::vector<EnduranceRow> rows;
    RowSums sums;
    std::size_t patches = 0;
    if (!options.json) print_head();
    Progress progress("endure", frames);
    for (std::size_t i = 0; i < frames; ++i) {
        const bool measured = i % static_cast<std::size_t>(options.measure_every) == 0;
        const auto frame = stream->next(measured);
        if (!frame) return tl::unexpected(frame.error());
        ++sums.frames;
        sums.bytes += frame->bytes;
        ++sums.row.frames[static_cast<std::size_t>(frame->type)];
        if (frame->renewal) ++sums.row.renewals;
        if (frame->type == FrameType::intra) patches = 0;
        if (frame->type == FrameType::patched) ++patches;
        sums.patches += static_cast<double>(patches);
        if (measured) {
            const auto error = surface_error(frame->surface, frame->decoded, surface_options);
            if (!error) return tl::unexpected(error.error());
            ++sums.measured;
            sums.squared += m2(*error) * m2(*error);
            const auto slid = drift.add(marks_mesh(frame->truth), frame->decoded);
            if (!slid) return tl::unexpected(slid.error());
            if (slid->age > 0) {
                ++sums.drifting;
                sums.drift += slid->mean_mm;
                sums.p95 += slid->p95_mm;
            }
        }
        progress.step();
        if (sums.frames < frames_in_row && i + 1 < frames) continue;
        rows.push_back(finished(sums, fps));
        if (!options.json) print_row(rows.back());
        sums = {};
        sums.row.from_s = rows.back().until_s;
    }
    return rows;
}

// ---- The output -----------------------------------------------------------------------------------------------------

nlohmann::ordered_json as_json(const Options& options, const std::vector<EnduranceRow>& rows) {
    nlohmann::ordered_json out = {{"program", "htvm-lab " HTVM_VERSION},
                                  {"vertices", options.stream.synth.vertices},
                                  {"frames_per_second", options.stream.synth.fps},
                                  {"quality", options.stream.quality},
                                  {"seed", options.stream.synth.seed},
                                  {"measured_every", options.measure_every}};
    auto& list = out["rows"] = nlohmann::ordered_json::array();
    for (const auto& row : rows) {
        nlohmann::ordered_json line = {{"from_s", row.from_s}, {"until_s", row.until_s}};
        for (const auto& kind : frame_kinds) {
            const auto count = row.frames[static_cast<std::size_t>(kind.type)];
            if (count > 0) line["frames"][kind.letter] = count;
        }
        line["renewals"] = row.renewals;
        for (const auto& measure : endurance_measures) line[measure.key] = row.*measure.value;
        list.push_back(std::move(line));
    }
    for (const auto& measure : endurance_measures) {
        const auto grown = growth(rows, measure);
        out["growth"][measure.key] = grown ? nlohmann::ordered_json(*grown) : nlohmann::ordered_json();
    }
    return out;
}

void print_growth(const std::vector<EnduranceRow>& rows) {
    if (rows.size() < 5) {
        note("less than five rows do not tell whether anything grows");
        return;
    }
    fmt::print("\nlast fifth of the time relative to the second fifth:\n");
    for (const auto& measure : endurance_measures) {
        const auto grown = growth(rows, measure);
        fmt::print("  {:<28}{:>8}  {}\n", measure.title, grown ? fmt::format("{:.3f}", *grown) : "n/a",
                   grown && *grown <= most_growth ? "flat" : "not flat");
    }
}

// endure.json, and a curve over time of each measure if gnuplot is installed.
Result<void> write_outputs(const Options& options, const std::vector<EnduranceRow>& rows) {
    const std::filesystem::path folder(options.output);
    if (auto made = make_folder(folder); !made) return made;
    if (auto ok = write_text(folder / "endure.json", as_json(options, rows).dump(1) + "\n"); !ok) return ok;
    std::string script;
    for (const auto& measure : endurance_measures) {
        Chart chart;
        chart.title = measure.title;
        chart.x_label = "minutes";
        chart.y_label = measure.title;
        chart.key = "";
        ChartLine line;
        line.colour = "#0072b2";
        std::vector<double> times, values;
        for (const auto& row : rows) {
            line.points.push_back({row.until_s / 60, row.*measure.value});
            times.push_back(row.until_s / 60);
            values.push_back(row.*measure.value);
        }
        chart.x = zero_axis(times);
        chart.y = zero_axis(values);
        chart.lines.push_back(std::move(line));
        script += chart_script(chart, folder / (std::string(measure.key) + ".svg"));
    }
    const auto drawn = run_gnuplot(script, folder / "endure.gp");
    if (!drawn) warn(drawn.error().message);
    note(fmt::format("{}: endure.json{}", folder.string(), drawn ? " and the curves" : ""));
    return {};
}

Result<void> endure(const Options& options) {
    const auto rows = measure(options);
    if (!rows) return tl::unexpected(rows.error());
    if (options.json)
        fmt::print("{}\n", as_json(options, *rows).dump(1));
    else
        print_growth(*rows);
    return options.output.empty() ? Result<void>() : write_outputs(options, *rows);
}

}  // namespace

void add_endure(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    o.stream.synth.vertices = 3000;
    auto* command = app.add_subcommand("endure", "Minutes of motion: whether bits, errors, drift or memory grow");
    command->description(
        "Makes minutes of synthetic motion, encodes and decodes them frame by frame, all in memory, and tells every\n"
        "10 seconds what became of bits, errors, drift along the surface, patches and memory.");
    command->add_option("--minutes", o.minutes, "How long")->check(CLI::Range(0.01, 600.0))->capture_default_str();
    add_synthetic_options(*command, o.stream);
    command->add_option("--measure-every", o.measure_every, "Measure M2 and drift in every n-th frame")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--marks", o.marks, "How many points of the surface are followed for the drift")
        ->check(CLI::Range(1, 20000))
        ->capture_default_str();
    command->add_option("-o,--output", o.output, "Folder for endure.json, and curves over time if gnuplot is there")
        ->type_name("FOLDER");
    command->add_flag("--json", o.json, "Print endure.json on standard output instead of the table");
    command->footer(
        "renewed: I-frames that were made of the tracked mesh; M2: RMS distance to the surface without noise, mm; "
        "drift\n"
        "along the surface, mm, since the mesh's triangles were new (htvm compare --truth): mean, and 95th "
        "percentile;\n"
        "patches: TP-frames since the I-frame, on average; MB: resident memory of the whole process, which makes the\n"
        "capture and measures it as well. At the end each is flat if the last fifth of the time has at most 1.15 "
        "times\n"
        "what the second fifth has.\n\n"
        "Example:\n"
        "  htvm-lab endure --minutes 5 --motion everyday --vertices 3000 -o out/endure");
    command->callback([options, &run] { run = [options] { return endure(*options); }; });
}

}  // namespace htvm::lab
