#include "comparison_report.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command_line/terminal.h"
#include "comparison_output.h"
#include "coverage_report.h"
#include "flicker_report.h"
#include "io/output_file.h"
#include "region_report.h"

namespace htvm::app {

Result<void> write_csv(const ComparisonRequest& options, const Measured& measured, double peak_mm) {
    std::string text = csv_header(options.compare);
    if (!measured.flickers.empty()) text += ",kind,flicker_lit,flicker_unlit,flicker_still_lit,flicker_still_unlit";
    if (!measured.drifts.empty()) text += ",drift_age,drift_mean_mm,drift_p95_mm";
    if (options.compare.coverage) text += coverage_names(measured.coverage);
    text += '\n';
    for (std::size_t i = 0; i < measured.frames.size(); ++i) {
        text += csv_line(measured.places[i], measured.frames[i], options.compare, peak_mm);
        if (!measured.flickers.empty()) text += flicker_cells(measured.flickers[i]);
        if (!measured.drifts.empty()) {
            const FrameDrift& drift = measured.drifts[i];
            text += fmt::format(",{},{:.8g},{:.8g}", drift.age, drift.mean_mm, drift.p95_mm);
        }
        if (options.compare.coverage) text += coverage_cells(measured.frames[i].coverage, measured.coverage, i);
        text += '\n';
    }
    if (options.csv == "-") {
        fmt::print("{}", text);
        return {};
    }
    return write_file(options.csv, text);
}

namespace {

WorstRegions regions_of(const Measured& measured) {
    WorstRegions out{{}, measured.kinds};
    for (const auto& frame : measured.frames) out.worst_mm.push_back(frame.region.worst_mm);
    return out;
}

// The frames that one would look at first: the three with most of what is measured of each, the worst one first.
template <class Measure>
std::vector<std::size_t> farthest_off(const Measured& measured, Measure of) {
    constexpr std::size_t most = 3;
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < measured.frames.size(); ++i)
        if (of(measured.frames[i]) > 0) order.push_back(i);
    const auto count = std::min(most, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                      [&](std::size_t a, std::size_t b) { return of(measured.frames[a]) > of(measured.frames[b]); });
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < count; ++k) out.push_back(measured.places[order[k]]);
    return out;
}

struct FarthestFrames {
    std::vector<std::size_t> by_m2, by_region;  // numbers
};
FarthestFrames farthest_frames(const CompareOptions& options, const Measured& measured) {
    FarthestFrames out;
    if (options.surface) out.by_m2 = farthest_off(measured, [](const auto& frame) { return m2(frame.surface); });
    if (options.regions)
        out.by_region = farthest_off(measured, [](const auto& frame) { return frame.region.worst_mm; });
    return out;
}

std::string farthest_rows(const FarthestFrames& frames) {
    std::string out;
    if (frames.by_m2.size() > 1) out += fmt::format("  by M2: {}\n", fmt::join(frames.by_m2, ", "));
    if (frames.by_region.size() > 1)
        out += fmt::format("  by the worst region: {}\n", fmt::join(frames.by_region, ", "));
    return out.empty() ? out : "\n  frames that are farthest off; --csv FILE lists all\n" + out;
}

nlohmann::json drift_json(const FrameDrift& drift) {
    return {{"age", drift.age}, {"marks", drift.marks}, {"mean_mm", drift.mean_mm}, {"p95_mm", drift.p95_mm}};
}

// Overall, and at some ages.
std::string drift_rows(const DriftMeter& meter) {
    const auto by_age = meter.by_age();
    const FrameDrift all = meter.overall();
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}\n", "drift along the surface, mm", "mean", "95 %");
    const auto add = [&](const std::string& what, const FrameDrift& drift) {
        out += fmt::format("  {:<34}{:>12.3f}{:>12.3f}\n", what, drift.mean_mm, drift.p95_mm);
    };
    for (const std::size_t age : {0, 1, 2, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000})
        if (age < by_age.size() && by_age[age].marks > 0)
            add(age == 0 ? "  at the reference" : fmt::format("  after {}", counted(age, "frame")), by_age[age]);
    if (all.marks > 0)
        add("  all frames but references", all);
    else
        out += "  no frame has the same triangles as the one before: nothing slides\n";
    return out;
}

}  // namespace

nlohmann::json as_json(const ComparisonRequest& options, const Measured& measured, double peak_mm) {
    nlohmann::json frames = nlohmann::json::array();
    for (std::size_t i = 0; i < measured.frames.size(); ++i) {
        const auto& frame = measured.frames[i];
        auto line = summary_json(summarise(as_sequence(frame), peak_mm), options.compare);
        line["frame"] = measured.places[i];
        if (options.compare.regions)
            line["worst_region"] = {{"rms_mm", frame.region.worst_mm}, {"centre_mm", frame.region.centre}};
        if (options.compare.coverage) line["coverage"] = coverage_json(frame.coverage, measured.coverage, i);
        line["original_vertices"] = frame.original_vertices;
        line["decoded_vertices"] = frame.decoded_vertices;
        if (options.compare.topology) {
            line["original_topology"] = topology_json(frame.original_topology);
            line["decoded_topology"] = topology_json(frame.decoded_topology);
        }
        if (!measured.drifts.empty()) line["drift"] = drift_json(measured.drifts[i]);
        if (!measured.flickers.empty()) {
            const auto& [change, kind] = measured.flickers[i];
            if (change) line["flicker"] = flicker_json(*change);
            if (kind) line["kind"] = kind_of(*kind).letter;
        }
        frames.push_back(std::move(line));
    }
    nlohmann::json out = {
        {"original", options.originals.front()}, {"decoded", options.decoded}, {"frames", std::move(frames)}};
    const ComparisonSummary summary = summarise(measured.sums, peak_mm);
    out["sequence"] = summary_json(summary, options.compare);
    if (options.compare.regions) out["sequence"]["worst_region"] = regions_json(regions_of(measured));
    if (options.compare.coverage)
        out["sequence"]["coverage"] = coverage_json(summary, options.compare, measured.coverage);
    if (!measured.drifts.empty()) {
        auto& drift = out["sequence"]["drift"] = drift_json(measured.drift.overall());
        drift.erase("age");
        for (const FrameDrift& of_age : measured.drift.by_age()) drift["by_age"].push_back(drift_json(of_age));
    }
    if (has_flicker(measured.flickers)) out["sequence"]["flicker"] = flicker_json(measured.flickers);
    const auto farthest = farthest_frames(options.compare, measured);
    if (!farthest.by_m2.empty()) out["sequence"]["m2"]["farthest_frames"] = farthest.by_m2;
    if (!farthest.by_region.empty()) out["sequence"]["worst_region"]["farthest_frames"] = farthest.by_region;
    return out;
}

std::string as_table(const ComparisonRequest& options, const Measured& measured) {
    std::string out = comparison_table(measured.sums, options.compare, options.peak_mm);
    if (options.compare.regions) out += region_rows("worst region of 10 cm, RMS mm", regions_of(measured));
    if (options.compare.coverage)
        out += coverage_rows(summarise(measured.sums, options.peak_mm), options.compare, measured.coverage);
    if (!measured.drifts.empty()) out += drift_rows(measured.drift);
    if (has_flicker(measured.flickers)) out += flicker_rows(measured.flickers, options.compare.render.shading);
    out += farthest_rows(farthest_frames(options.compare, measured));
    return out;
}

}  // namespace htvm::app
