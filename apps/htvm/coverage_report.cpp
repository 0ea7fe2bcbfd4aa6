#include "coverage_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "comparison_output.h"

namespace htvm::app {
namespace {

std::string percent_row(const std::string& what, double captured, double shown) {
    return fmt::format("  {:<34}{:>12.2f}{:>12.2f}\n", what, 100 * captured, 100 * shown);
}

std::optional<PresenceChange> sum_of(const std::vector<std::optional<PresenceChange>>& changes) {
    std::optional<PresenceChange> out;
    for (const auto& change : changes)
        if (change) out ? * out += *change : out.emplace(*change);
    return out;
}

TruthCoverage sum_of(const std::vector<TruthCoverage>& truths) {
    TruthCoverage out;
    for (const auto& truth : truths) out += truth;
    return out;
}

std::string truth_rows(const TruthCoverage& truth) {
    const auto share = [&](double TruthCoverage::*area) { return truth_share(truth, area); };
    return fmt::format("\n  {:<34}{:>12}{:>12}\n", "beside the whole, true surface", "captured", "shown") +
           percent_row("  covered of it, %", share(&TruthCoverage::captured), share(&TruthCoverage::shown)) +
           fmt::format("  {:<34}{:>12}{:>12.2f}\n", "  holes of the capture, filled, %", "",
                       100 * share(&TruthCoverage::filled)) +
           fmt::format("  {:<34}{:>12}{:>12.2f}\n", "  captured, but not shown, %", "",
                       100 * share(&TruthCoverage::lost)) +
           fmt::format("  {:<34}{:>12.4f}{:>12.4f}\n", "  distance to it, RMS mm", captured_to_truth_rms(truth),
                       shown_to_truth_rms(truth));
}

nlohmann::json truth_json(const TruthCoverage& truth) {
    return {{"captured_rms_mm", captured_to_truth_rms(truth)},
            {"shown_rms_mm", shown_to_truth_rms(truth)},
            {"captured", truth_share(truth, &TruthCoverage::captured)},
            {"shown", truth_share(truth, &TruthCoverage::shown)},
            {"filled", truth_share(truth, &TruthCoverage::filled)},
            {"lost", truth_share(truth, &TruthCoverage::lost)}};
}

nlohmann::json change_json(const AreaChange& change) {
    const double area = std::max(change.area, std::numeric_limits<double>::min());
    return {{"changed", changed_share(change)},
            {"appeared", change.appeared / area},
            {"vanished", change.vanished / area},
            {"covered_by_frame_before", covered_before_share(change)}};
}

void add_changes(nlohmann::json& out, const std::optional<PresenceChange>& change) {
    if (!change) return;
    out["captured"].update(change_json(change->captured));
    out["shown"].update(change_json(change->shown));
}

// What a frame has to say beside its comparison, with the name of the CSV's column; no value: not measured.
struct Cell {
    const char* name;
    std::optional<double> value;
};

std::vector<Cell> cells(const FrameCoverage& c, const std::optional<PresenceChange>& change,
                        const TruthCoverage* truth) {
    const auto if_any = [&](bool any, double value) { return any ? std::optional(value) : std::nullopt; };
    const bool has = has_covered_errors(c);
    std::vector<Cell> out{{"captured_covered", covered_share(c.captured)},
                          {"shown_covered", covered_share(c.shown)},
                          {"captured_absent", absent_share(c.captured)},
                          {"shown_absent", absent_share(c.shown)},
                          {"covered_m2_mm", if_any(has, covered_m2(c))},
                          {"covered_m2_forward_mm", if_any(has, c.captured.distances.rms)},
                          {"covered_m2_backward_mm", if_any(has, c.shown.distances.rms)},
                          {"covered_worst_region_mm", if_any(c.region.regions > 0, c.region.worst_mm)},
                          {"captured_changed", {}},
                          {"shown_changed", {}},
                          {"captured_covered_by_frame_before", {}},
                          {"shown_covered_by_frame_before", {}}};
    if (change) {
        const std::array values = {changed_share(change->captured), changed_share(change->shown),
                                   covered_before_share(change->captured), covered_before_share(change->shown)};
        for (std::size_t i = 0; i < values.size(); ++i) out[out.size() - values.size() + i].value = values[i];
    }
    if (!truth) return out;
    for (const auto& [name, area] :
         {std::pair{"truth_captured", &TruthCoverage::captured}, std::pair{"truth_shown", &TruthCoverage::shown},
          std::pair{"truth_filled", &TruthCoverage::filled}, std::pair{"truth_lost", &TruthCoverage::lost}})
        out.push_back({name, truth_share(*truth, area)});
    out.push_back({"truth_captured_rms_mm", captured_to_truth_rms(*truth)});
    out.push_back({"truth_shown_rms_mm", shown_to_truth_rms(*truth)});
    return out;
}

}  // namespace

void add_region(CoverageFrames& frames, const FrameCoverage& coverage, std::optional<FrameType> kind) {
    frames.regions.worst_mm.push_back(coverage.region.regions > 0 ? coverage.region.worst_mm
                                                                  : std::numeric_limits<double>::quiet_NaN());
    frames.regions.kinds.push_back(kind);
}

std::string coverage_rows(const ComparisonSummary& s, const CompareOptions& options, const CoverageFrames& frames) {
    const auto title = fmt::format("coverage within {:g} mm, % of area", options.coverage_options.within);
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}\n", title, "captured", "shown") +
                      percent_row("  covered by the other", s.captured_covered, s.shown_covered) +
                      percent_row("    in the frame with the least", s.captured_least_covered, s.shown_least_covered) +
                      percent_row("  absent in the other", s.captured_absent, s.shown_absent);
    if (const auto change = sum_of(frames.changes))
        out += percent_row("  covered by its frame before", covered_before_share(change->captured),
                           covered_before_share(change->shown)) +
               percent_row("  appears or vanishes, a frame", changed_share(change->captured),
                           changed_share(change->shown));
    if (!s.has_covered) return out + "\n  nothing is covered: there are no errors to measure\n";
    const auto &f = s.covered_forward, &b = s.covered_backward;
    out += fmt::format("\n  {:<34}{:>12}{:>12}{:>12}\n", "over what is covered", "forward", "backward", "larger") +
           row("M2 surface, RMS mm", f.rms, b.rms, s.covered_m2_mm, 4) +
           row("  mean, mm", f.mean, b.mean, std::max(f.mean, b.mean), 4) +
           row("  largest, mm", f.largest, b.largest, std::max(f.largest, b.largest), 3) +
           single("  worst frame, RMS mm", s.covered_worst_frame_mm, 4) +
           region_rows("worst region there, RMS mm", frames.regions);
    if (!frames.truths.empty()) out += truth_rows(sum_of(frames.truths));
    return out;
}

nlohmann::json coverage_json(const ComparisonSummary& s, const CompareOptions& options, const CoverageFrames& frames) {
    nlohmann::json out = {
        {"within_mm", options.coverage_options.within},
        {"captured",
         {{"covered", s.captured_covered}, {"least_covered", s.captured_least_covered}, {"absent", s.captured_absent}}},
        {"shown",
         {{"covered", s.shown_covered}, {"least_covered", s.shown_least_covered}, {"absent", s.shown_absent}}}};
    add_changes(out, sum_of(frames.changes));
    if (s.has_covered) {
        out["m2"] = {{"rms_mm", s.covered_m2_mm},
                     {"worst_frame_mm", s.covered_worst_frame_mm},
                     {"forward", distances_json(s.covered_forward)},
                     {"backward", distances_json(s.covered_backward)}};
        out["worst_region"] = regions_json(frames.regions);
    }
    if (!frames.truths.empty()) out["truth"] = truth_json(sum_of(frames.truths));
    return out;
}

nlohmann::json coverage_json(const FrameCoverage& c, const CoverageFrames& frames, std::size_t frame) {
    nlohmann::json out = {{"captured", {{"covered", covered_share(c.captured)}, {"absent", absent_share(c.captured)}}},
                          {"shown", {{"covered", covered_share(c.shown)}, {"absent", absent_share(c.shown)}}}};
    add_changes(out, frames.changes[frame]);
    if (has_covered_errors(c))
        out["m2"] = {{"rms_mm", covered_m2(c)},
                     {"forward", distances_json(c.captured.distances)},
                     {"backward", distances_json(c.shown.distances)}};
    if (c.region.regions > 0) out["worst_region"] = {{"rms_mm", c.region.worst_mm}, {"centre_mm", c.region.centre}};
    if (!frames.truths.empty()) out["truth"] = truth_json(frames.truths[frame]);
    return out;
}

std::string coverage_names(const CoverageFrames& frames) {
    std::string out;
    const TruthCoverage none;
    for (const auto& cell : cells({}, {}, frames.truths.empty() ? nullptr : &none))
        out += fmt::format(",{}", cell.name);
    return out;
}

std::string coverage_cells(const FrameCoverage& coverage, const CoverageFrames& frames, std::size_t frame) {
    std::string out;
    for (const auto& cell :
         cells(coverage, frames.changes[frame], frames.truths.empty() ? nullptr : &frames.truths[frame]))
        out += cell.value ? fmt::format(",{:.8g}", *cell.value) : ",";
    return out;
}

}  // namespace htvm::app
