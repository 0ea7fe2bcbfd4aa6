#include "findings.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "charts.h"
#include "command_line/layer_table.h"
#include "figures.h"
#include "galleries.h"
#include "results.h"

namespace htvm::lab {

using namespace app;

// ---- Which coder is ahead where -------------------------------------------------------------------------------------

namespace {

struct RateRange {
    double low = std::numeric_limits<double>::infinity(), high = 0;
};

RateRange rates_of(std::span<const RdPoint> points, const std::string& coder) {
    RateRange out;
    for (const auto& point : points) {
        if (point.coder != coder) continue;
        out.low = std::min(out.low, bits_per_vertex(point));
        out.high = std::max(out.high, bits_per_vertex(point));
    }
    return out;
}

std::string quality_words(const CurveCrossing& crossing, const Measure& measure) {
    const double value = measure.is_error ? std::exp(-crossing.quality) : crossing.quality;
    return fmt::format("{:.{}f} {}", value, std::min(measure.digits, 2), measure.unit);
}

std::string capitalised(std::string text) {
    if (!text.empty() && text[0] >= 'a' && text[0] <= 'z' && !text.starts_with("htvm"))
        text[0] = static_cast<char>(text[0] - 'a' + 'A');
    return text;
}

}  // namespace

const Measure& measure_of(const std::string& key) {
    const auto all = measures();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Measure& m) { return key == m.key; });
    return found == all.end() ? all.front() : *found;
}

Contest contest(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                const std::string& measure) {
    const auto a = rate_curve(points, first, measure_of(measure)), b = rate_curve(points, second, measure_of(measure));
    Contest out;
    if (a.size() < 2 || b.size() < 2) return out;
    out.rate_difference = bjontegaard_rate_difference(b, a);
    out.crossings = curve_crossings(a, b);
    const auto ra = rates_of(points, first), rb = rates_of(points, second);
    out.low = std::max(ra.low, rb.low);
    out.high = std::min(ra.high, rb.high);
    if (out.low < out.high && out.crossings.empty()) {
        const double middle = std::sqrt(out.low * out.high);
        const auto qa = quality_at_rate(a, middle), qb = quality_at_rate(b, middle);
        if (qa && qb && *qa != *qb) out.leader = *qa > *qb ? 1 : 2;
    }
    return out;
}

std::optional<double> ahead_below(const Contest& c) {
    if (c.crossings.empty()) {
        if (c.leader == 1) return std::numeric_limits<double>::infinity();
        return std::nullopt;
    }
    if (!c.crossings.front().first_ahead_below) return std::nullopt;
    return c.crossings.front().rate;
}

std::string bits_phrase(double difference) {
    const double percent = 100 * std::abs(difference);
    if (percent < 0.05) return "as many bits";
    return fmt::format("{:.1f} % {} bits", percent, difference < 0 ? "fewer" : "more");
}

std::string contest_sentence(const Contest& c, const std::string& first, const std::string& second,
                             const std::string& measure) {
    const std::string a = look_of_coder(first).name, b = look_of_coder(second).name;
    const Measure& m = measure_of(measure);
    std::string out;
    if (!(c.low < c.high)) {
        out = fmt::format("{} and {} share no range of rates here.", capitalised(a), b);
    } else if (c.crossings.empty()) {
        if (c.leader == 0) return fmt::format("{} and {} are level.", capitalised(a), b);
        out = fmt::format("{} is ahead of {} at every rate that both reach ({:.1f} to {:.1f} bpvf).",
                          capitalised(c.leader == 1 ? a : b), c.leader == 1 ? b : a, c.low, c.high);
    } else if (c.crossings.size() == 1) {
        const auto& crossing = c.crossings.front();
        out = fmt::format("{} is ahead of {} below {:.1f} bpvf (at {}), and behind above.",
                          capitalised(crossing.first_ahead_below ? a : b), crossing.first_ahead_below ? b : a,
                          crossing.rate, quality_words(crossing, m));
    } else {
        out = fmt::format("{} and {} cross at", capitalised(a), b);
        for (std::size_t i = 0; i < c.crossings.size(); ++i)
            out += fmt::format("{} {:.1f}",
                               i == 0                        ? ""
                               : i + 1 == c.crossings.size() ? " and"
                                                             : ",",
                               c.crossings[i].rate);
        out += fmt::format(" bpvf; below the first, {} is ahead.", c.crossings.front().first_ahead_below ? a : b);
    }
    if (c.rate_difference)
        out += fmt::format(" Over the range of qualities that both reach, {} takes {} than {}.", a,
                           bits_phrase(*c.rate_difference), b);
    return out;
}

std::string contest_phrase(const Contest& c) {
    if (!(c.low < c.high)) return "no common rates";
    if (c.crossings.empty())
        return c.leader == 0
                   ? "level"
                   : fmt::format("{} from {:.1f} to {:.1f} bpvf", c.leader == 1 ? "ahead" : "behind", c.low, c.high);
    const auto& crossing = c.crossings.front();
    return fmt::format("{} below {:.1f} bpvf{}", crossing.first_ahead_below ? "ahead" : "behind", crossing.rate,
                       c.crossings.size() > 1 ? ", then crossing again" : "");
}

std::optional<double> geometry_step_at_rate(std::span<const RdPoint> points, const std::string& coder, double rate) {
    std::vector<RatePoint> curve;
    for (const auto& point : points)
        if (point.coder == coder && point.geometry_step > 0)
            curve.push_back({bits_per_vertex(point), -std::log(point.geometry_step)});
    const auto at = quality_at_rate(curve, rate);
    if (!at) return std::nullopt;
    return std::exp(-*at);
}

std::vector<double> matched_rates(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                                  int count, double highest) {
    const auto a = rates_of(points, first), b = rates_of(points, second);
    // Slightly inside, so that both can be interpolated.
    const double low = 1.02 * std::max(a.low, b.low);
    double high = 0.98 * std::min(a.high, b.high);
    if (!(low < high)) return {};
    if (highest > low) high = std::min(high, highest);
    std::vector<double> out;
    for (int i = 0; i < count; ++i)
        out.push_back(count == 1 ? high : low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
    return out;
}

// ---- The report's text and tables, and its JSON ---------------------------------------------------------------------

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
                                     totals(point).bytes[Layer::colour] > 0 || point.values.contains("m1_colour")
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
        table.rows.push_back(
            {look_of_coder(point.coder).name, fmt::format("{:.2f}", point.geometry_step), std::to_string(sums.frames),
             bpv(b.total()), bpv(b[Layer::geometry]), bpv(b[Layer::mapping]), bpv(b[Layer::fans]),
             bpv(b[Layer::distance_orders]),
             bpv(b.total() - b[Layer::geometry] - b[Layer::mapping] - b[Layer::fans] - b[Layer::distance_orders])});
    }
    return table;
}

Table contest_table(const Findings& findings) {
    Table table;
    table.title = "Who is ahead";
    table.head = {"Coder", "against", "M1 rate", "M1", "M2 rate", "M2"};
    const std::pair<const char*, const char*> pairs[] = {
        {"paper", "tfan-mpeg"}, {"tfan", "tfan-mpeg"}, {"paper", "tfan"},      {"htvm-ep", "tfan"},
        {"draco10", "tfan"},    {"paper", "draco10"},  {"htvm-ep", "draco10"}, {"tfan", "draco10"}};
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

nlohmann::json noise_json(const std::vector<std::pair<double, std::vector<RdPoint>>>& noise) {
    auto out = nlohmann::json::array();
    for (const auto& [power, points] : noise) out.push_back({{"power_mm2", power}, {"points", points_json(points)}});
    return out;
}

}  // namespace

std::vector<std::string> summary_paragraphs(const std::string& what, const Findings& findings,
                                            const std::vector<Claim>& claims) {
    std::vector<std::string> out;
    if (!findings.geometry.empty()) {
        out.push_back(fmt::format(
            "{} went through five coders: the paper's, which moves an earlier mesh by its skeleton and sends what "
            "remains; htvm-ep, the same with our own choices; and three that code every mesh by itself: our TFAN, TFAN "
            "as in MPEG-4, which the paper compared with, and Draco.",
            what));
        std::string text;
        for (const char* peer : {"tfan-mpeg", "tfan"}) {
            const auto m1 = contest(findings.geometry, "paper", peer, "m1_mm");
            text += contest_sentence(m1, "paper", peer, "m1_mm") + " ";
        }
        text += "The paper reports the change of lead against TFAN as in MPEG-4 at 12 to 14 bpvf.";
        for (const char* coder : {"htvm-ep", "tfan"}) {
            const auto found = contest(findings.geometry, coder, "draco10", "m1_mm");
            if (found.rate_difference)
                text += fmt::format(" {} takes {} than Draco for the same M1.", capitalised(look_of_coder(coder).name),
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
        out.push_back(
            rate_table_of(findings.pictures, "Pictures",
                          {"m3_foreground_db", "m3_full_db", "m3_ssim", "m3_unlit_db", "m3_unlit_ssim", "m1_mm"}));
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
                          {"noise", noise_json(findings.noise)},
                          {"camera_noise", noise_json(findings.camera_noise)},
                          {"rate_differences",
                           {{"draco10", rate_differences_json(findings.geometry, "draco10")},
                            {"tfan", rate_differences_json(findings.geometry, "tfan")},
                            {"tfan-mpeg", rate_differences_json(findings.geometry, "tfan-mpeg")}}}};
    if (findings.internals) out["internals"] = internals_json(*findings.internals);
    return out;
}

}  // namespace htvm::lab
