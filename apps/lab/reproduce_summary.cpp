#include "reproduce_summary.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command_line/layer_table.h"
#include "rd_report.h"
#include "reproduce_findings.h"
#include "reproduce_motion_gallery.h"

namespace htvm::lab {

using namespace app;
namespace {

std::string cell(const RdPoint& point, const std::string& measure) {
    const auto found = point.values.find(measure);
    return found == point.values.end() ? "" : fmt::format("{:.{}f}", found->second, measure_of(measure).digits);
}

std::string percent(const std::optional<double>& difference) {
    return difference ? fmt::format("{:+.1f} %", 100 * *difference) : "n/a";
}

Table rate_table_of(const std::vector<RdPoint>& points, const std::string& title,
                    const std::vector<const char*>& shown) {
    Table table;
    table.title = title;
    table.head = {"Coder", "step mm", "colour step", "bpvf", "Mbit/s"};
    for (const char* key : shown)
        table.head.push_back(fmt::format("{} {}", measure_of(key).brief, measure_of(key).unit));
    table.head.insert(table.head.end(), {"encode fps", "decode fps"});
    for (const auto& point : points) {
        const auto decoding = decode_fps(point);
        std::vector<std::string> row{look_of_coder(point.coder).name, fmt::format("{:.2f}", point.geometry_step),
                                     totals(point).bytes.colour > 0 || point.values.contains("m1_colour")
                                         ? fmt::format("{:g}", point.colour_step)
                                         : "",
                                     fmt::format("{:.2f}", bits_per_vertex(point)),
                                     fmt::format("{:.2f}", megabits_per_second(point))};
        for (const char* key : shown) row.push_back(cell(point, key));
        row.push_back(fmt::format("{:.1f}", encode_fps(point)));
        row.push_back(decoding ? fmt::format("{:.1f}", *decoding) : "");
        table.rows.push_back(std::move(row));
    }
    table.note =
        "bpvf: bits per captured vertex over all frames, I-frames counted. Speeds: processor time of one thread.";
    return table;
}

Table layer_table_of(const std::vector<RdPoint>& points) {
    Table table;
    table.title = "EP-frames by layer, bits per vertex";
    table.head = {"Coder", "step mm", "EP-frames", "all", "geometry", "mapping", "fans", "distance orders", "other"};
    for (const auto& point : points) {
        const auto sums = totals(point, FrameType::enhanced);
        if (sums.frames == 0) continue;
        auto bpv = [&](std::size_t bytes) {
            return fmt::format("{:.2f}", app::bits_per_vertex(bytes, sums.source_vertices));
        };
        const auto& b = sums.bytes;
        table.rows.push_back({look_of_coder(point.coder).name, fmt::format("{:.2f}", point.geometry_step),
                              std::to_string(sums.frames), bpv(b.total()), bpv(b.geometry), bpv(b.mapping), bpv(b.fans),
                              bpv(b.distance_orders),
                              bpv(b.total() - b.geometry - b.mapping - b.fans - b.distance_orders)});
    }
    return table;
}

Table contest_table(const Findings& findings) {
    Table table;
    table.title = "Who is ahead";
    table.head = {"Coder", "against", "M1 rate", "M1", "M2 rate", "M2"};
    const std::pair<const char*, const char*> pairs[] = {{"paper", "tfan"},      {"htvm-ep", "tfan"},
                                                         {"draco10", "tfan"},    {"paper", "draco10"},
                                                         {"htvm-ep", "draco10"}, {"tfan", "draco10"}};
    for (const auto& [first, second] : pairs) {
        const auto m1 = contest(findings.geometry, first, second, "m1_mm");
        const auto m2 = contest(findings.geometry, first, second, "m2_mm");
        if (!(m1.low < m1.high) && !m1.rate_difference) continue;
        table.rows.push_back({look_of_coder(first).name, look_of_coder(second).name, percent(m1.rate_difference),
                              contest_phrase(m1), percent(m2.rate_difference), contest_phrase(m2)});
    }
    table.note =
        "Rate: Bjontegaard's difference, bits at equal error over the range that both coders reach; negative is "
        "fewer bits. Geometry alone.";
    return table;
}

nlohmann::json points_json(const std::vector<RdPoint>& points) {
    auto list = nlohmann::json::array();
    for (const auto& point : points) list.push_back(to_json(point));
    return list;
}

nlohmann::json internals_json(const InternalRun& run) {
    auto frames = nlohmann::json::array();
    for (const auto& frame : run.frames) {
        auto json = frame_json(frame.info);
        json["encode_ms"] = frame.encode_ms;
        json["decode_ms"] = frame.decode_ms;
        frames.push_back(std::move(json));
    }
    auto stages = nlohmann::json::object();
    for (const auto& stage : run.stages) stages[stage.stage] = stage.milliseconds;
    return {{"quality", run.quality},
            {"geometry_step_mm", run.geometry_step},
            {"colour_step", run.colour_step},
            {"threads", run.threads},
            {"bits_per_vertex", run.bits_per_vertex},
            {"distance_order_frame", run.order_frame},
            {"distance_order_counts", run.distance_order_counts},
            {"encode_stage_ms", std::move(stages)},
            {"frames", std::move(frames)}};
}

nlohmann::json seams_json(const std::vector<SeamCounts>& seams) {
    const std::pair<const char*, Topology SeamCounts::*> stages[] = {{"captured", &SeamCounts::original},
                                                                     {"animated", &SeamCounts::animated},
                                                                     {"overlapping", &SeamCounts::overlapping},
                                                                     {"trimmed", &SeamCounts::trimmed},
                                                                     {"zippered", &SeamCounts::zippered}};
    auto list = nlohmann::json::array();
    for (const auto& seam : seams) {
        nlohmann::json entry = {{"frame", seam.frame}};
        for (const auto& [name, stage] : stages) {
            const auto& t = seam.*stage;
            entry[name] = {{"open_edges", t.open_edges}, {"non_manifold_edges", t.non_manifold_edges},
                           {"cracks", t.cracks},         {"crack_mm", t.crack_length},
                           {"flaps", t.flaps},           {"flap_mm2", t.flap_area}};
        }
        list.push_back(std::move(entry));
    }
    return list;
}

nlohmann::json facts_json(const FactList& facts) {
    auto out = nlohmann::json::object();
    for (const auto& [name, value] : facts) out[name] = value;
    return out;
}

}  // namespace

std::vector<std::string> summary_paragraphs(const std::string& what, const Findings& findings,
                                            const std::vector<Claim>& claims) {
    std::vector<std::string> out;
    if (!findings.geometry.empty()) {
        const auto m1 = contest(findings.geometry, "paper", "tfan", "m1_mm");
        out.push_back(fmt::format(
            "{} went through four coders: the paper's, which moves an earlier mesh by its skeleton and sends what "
            "remains; htvm-ep, the same with our own choices; our TFAN, which codes every mesh by itself; and Draco.",
            what));
        std::string text = contest_sentence(m1, "paper", "tfan", "m1_mm");
        text += " The paper reports the change of lead at 12 to 14 bpvf.";
        for (const char* coder : {"htvm-ep", "tfan"}) {
            const auto found = contest(findings.geometry, coder, "draco10", "m1_mm");
            if (found.rate_difference)
                text += fmt::format(" {} takes {} than Draco for the same M1.", look_of_coder(coder).name,
                                    bits_phrase(*found.rate_difference));
        }
        out.push_back(text);
    } else {
        out.push_back(what.substr(0, what.find_last_not_of(',') + 1) + ".");
    }
    const auto holding = std::count_if(claims.begin(), claims.end(), [](const Claim& claim) { return claim.holds; });
    if (!claims.empty())
        out.push_back(fmt::format("Of {} findings of the paper checked here, {} hold{}.", claims.size(),
                                  holding == 0 ? "none" : std::to_string(holding), holding == 1 ? "s" : ""));
    return out;
}

std::vector<Table> result_tables(const Findings& findings) {
    std::vector<Table> out;
    if (!findings.geometry.empty()) {
        out.push_back(contest_table(findings));
        out.push_back(rate_table_of(findings.geometry, "Geometry alone", {"m1_mm", "m2_mm", "hausdorff_mm"}));
        out.push_back(layer_table_of(findings.geometry));
    }
    if (!findings.colour.empty())
        out.push_back(rate_table_of(findings.colour, "Geometry and colour", {"m1_mm", "m1_colour"}));
    if (!findings.pictures.empty())
        out.push_back(rate_table_of(findings.pictures, "Pictures", {"m3_foreground_db", "m3_full_db", "m1_mm"}));
    if (auto table = motion_table(findings)) out.push_back(std::move(*table));
    if (auto table = seam_table(findings)) out.push_back(std::move(*table));
    return out;
}

nlohmann::json report_json(const Report& report, const Findings& findings) {
    auto figures = nlohmann::json::array();
    for (const auto& figure : report.figures) {
        auto files = nlohmann::json::array();
        for (const auto& chart : figure.charts) files.push_back(chart.filename().string());
        for (const auto& row : figure.tiles)
            for (const auto& tile : row) files.push_back(tile.png.filename().string());
        figures.push_back({{"number", figure.number},
                           {"title", figure.title},
                           {"paper", figure.paper},
                           {"found", figure.found},
                           {"how", figure.how},
                           {"skipped", figure.skipped},
                           {"files", std::move(files)}});
    }
    auto claims = nlohmann::json::array();
    for (const auto& claim : report.claims)
        claims.push_back({{"what", claim.what},
                          {"paper", claim.paper},
                          {"here", claim.here},
                          {"verdict", claim.verdict},
                          {"holds", claim.holds}});
    auto noise = nlohmann::json::array();
    for (const auto& [power, points] : findings.noise)
        noise.push_back({{"power_mm2", power}, {"points", points_json(points)}});
    nlohmann::json out = {{"title", report.title},
                          {"summary", report.summary},
                          {"capture", facts_json(report.capture)},
                          {"machine", facts_json(report.machine)},
                          {"commands", report.commands},
                          {"claims", std::move(claims)},
                          {"figures", std::move(figures)},
                          {"geometry", points_json(findings.geometry)},
                          {"key_intervals", points_json(findings.intervals)},
                          {"intra_choice", points_json(findings.intra_choice)},
                          {"predicted_choice", points_json(findings.predicted_choice)},
                          {"motion", points_json(findings.motion)},
                          {"seams", seams_json(findings.seams)},
                          {"colour", points_json(findings.colour)},
                          {"pictures", points_json(findings.pictures)},
                          {"noise", std::move(noise)},
                          {"rate_differences",
                           {{"draco10", rate_differences_json(findings.geometry, "draco10")},
                            {"tfan", rate_differences_json(findings.geometry, "tfan")}}}};
    if (findings.internals) out["internals"] = internals_json(*findings.internals);
    return out;
}

}  // namespace htvm::lab
