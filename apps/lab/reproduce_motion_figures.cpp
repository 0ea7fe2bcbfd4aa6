// Figures 7, 17 and 18: frames and bones chosen by the skeleton's motion.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "reproduce_figures.h"
#include "reproduce_findings.h"

namespace htvm::lab {

using namespace app;
namespace {

constexpr const char* rate_label = "bits per captured vertex and frame (bpvf)";
constexpr const char* no_skeleton = "the capture has no skeleton whose motion could choose.";
constexpr const char* colours[] = {"#0072b2", "#cc79a7", "#009e73"};

using ThresholdPoints = std::vector<std::pair<double, const RdPoint*>>;

double share_of(const RdPoint& point, FrameType type) {
    return static_cast<double>(totals(point, type).frames) /
           static_cast<double>(std::max<std::size_t>(point.frames.size(), 1));
}

double value_of(const RdPoint& point, const char* measure) {
    const auto found = point.values.find(measure);
    return found == point.values.end() ? 0 : found->second;
}

double encode_ms(const RdPoint& point) {
    const double fps = encode_fps(point);
    return fps > 0 ? 1000 / fps : 0;
}

double decode_ms(const RdPoint& point) {
    const double fps = decode_fps(point).value_or(0);
    return fps > 0 ? 1000 / fps : 0;
}

std::string threshold_list(const ThresholdPoints& points) {
    std::string out;
    for (std::size_t i = 0; i < points.size(); ++i)
        out += fmt::format("{}{:g}", i == 0 ? "" : i + 1 == points.size() ? " and " : ", ", points[i].first);
    return out + " mm";
}

// The rate's, as bits_phrase() has it.
std::string rate_change(const RdPoint& from, const RdPoint& to) {
    return bits_phrase(bits_per_vertex(to) / std::max(bits_per_vertex(from), 1e-9) - 1);
}

// How the second value stands to the first: "38 % less", "12 % more", "as much".
std::string change_words(double from, double to) {
    if (!(from > 0)) return "not known";
    const double percent = 100 * (to / from - 1);
    if (std::abs(percent) < 0.5) return "as much";
    return fmt::format("{:.0f} % {}", std::abs(percent), percent < 0 ? "less" : "more");
}

// The axes of all of a chart's lines from 0.
void start_at_zero(Chart& chart) {
    std::vector<double> xs, ys;
    for (const auto& line : chart.lines) {
        for (const auto& [x, y] : line.points) {
            xs.push_back(x);
            ys.push_back(y);
        }
    }
    chart.x = zero_axis(xs);
    chart.y = zero_axis(ys);
}

ThresholdPoints motion_points(const Findings& findings) {
    if (!findings.thresholds) return {};
    return by_threshold(findings.motion, still_below_words, findings.thresholds->still_below);
}

// A row of the table of thresholds.
std::vector<std::string> motion_row(double threshold, const RdPoint& point) {
    return {fmt::format("{:g} mm", threshold),
            fmt::format("{:.0f} / {:.0f} / {:.0f}", 100 * share_of(point, FrameType::intra),
                        100 * share_of(point, FrameType::enhanced), 100 * share_of(point, FrameType::predicted)),
            fmt::format("{:.2f}", bits_per_vertex(point)),
            fmt::format("{:.2f}", value_of(point, "m3_foreground_db")),
            fmt::format("{:.2f}", value_of(point, "m3_full_db")),
            fmt::format("{:.2f}", value_of(point, "m2_mm")),
            fmt::format("{:.1f}", encode_ms(point)),
            fmt::format("{:.1f}", decode_ms(point))};
}

}  // namespace

Figure figure_7_by_motion(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{"7",
                  "share of I-frames and bit rate",
                  "The more frames are I-frames, the higher the rate; the threshold on the skeletal motion goes from "
                  "400 to 500 mm.",
                  {},
                  {}};
    const auto& thresholds = *findings.thresholds;
    Chart chart;
    chart.title = "Share of I-frames, by threshold on the skeletal motion";
    chart.x_label = rate_label;
    chart.y_label = "I-frames, % of frames";
    for (std::size_t q = 0; q < plan.interval_qualities.size(); ++q) {
        std::vector<RdPoint> part;
        for (const auto& point : findings.intra_choice)
            if (point.quality == plan.interval_qualities[q]) part.push_back(point);
        const auto points = by_threshold(part, intra_above_words, thresholds.intra_above);
        if (points.empty()) continue;
        ChartLine line{{}, colours[q % 3], q % 2 == 0 ? 7 : 5, 1, {}};
        const auto &most = *points.front().second, &fewest = *points.back().second;
        line.title = fmt::format("step {:.2g} mm", most.geometry_step);
        for (const auto& [threshold, point] : points)
            line.points.push_back({bits_per_vertex(*point), 100 * share_of(*point, FrameType::intra)});
        figure.found += fmt::format(
            "{}At a step of {:.2g} mm, from a threshold of {:g} to one of {:g} mm, the share falls from {:.0f} to "
            "{:.0f} % and the rate goes from {:.2f} to {:.2f} bpvf: {}.",
            figure.found.empty() ? "" : " ", most.geometry_step, points.front().first, points.back().first,
            line.points.front()[1], line.points.back()[1], bits_per_vertex(most), bits_per_vertex(fewest),
            bits_per_vertex(fewest) < bits_per_vertex(most) ? "EP-frames save bits, as in the paper"
                                                            : "EP-frames cost more bits than I-frames at this step");
        if (q == 0)
            figure.how = "Thresholds of " + threshold_list(points) +
                         ", at equal parts of this capture's own skeletal motion (the sum over its bones); the paper's "
                         "400 and 500 mm would make " +
                         fmt::format("{:.0f} and {:.0f} % of its frames I-frames.", 100 * thresholds.share_at_400,
                                     100 * thresholds.share_at_500) +
                         " No longest interval, no P-frames. Geometry alone, the same steps for all points of a line.";
        chart.lines.push_back(std::move(line));
    }
    start_at_zero(chart);
    figure.charts.push_back(draw(easel, "figure_07", chart));
    return figure;
}

Figure figure_7_predicted(const Findings& findings, Easel& easel) {
    Figure figure{"7b",
                  "share of P-, EP- and I-frames",
                  "Frames whose skeleton moved less than another threshold are P-frames; the paper gives neither the "
                  "threshold nor what it costs.",
                  {},
                  {}};
    if (!findings.thresholds) {
        figure.skipped = no_skeleton;
        return figure;
    }
    const auto& wanted = findings.thresholds->predicted_below;
    const auto points = by_threshold(findings.predicted_choice, predicted_below_words, wanted);
    const auto checked = by_threshold(findings.predicted_choice, checked_words, wanted);
    if (points.empty()) {
        figure.skipped = "nothing was measured.";
        return figure;
    }
    Chart shares;
    shares.title = "Share of frames, by threshold";
    shares.x_label = "threshold on the skeletal motion, mm";
    shares.y_label = "% of frames";
    const std::pair<FrameType, const char*> types[] = {
        {FrameType::predicted, "P"}, {FrameType::enhanced, "EP"}, {FrameType::intra, "I"}};
    for (std::size_t i = 0; i < 3; ++i) {
        ChartLine line{types[i].second, colours[i], 7, 1, {}};
        for (const auto& [threshold, point] : points)
            line.points.push_back({threshold, 100 * share_of(*point, types[i].first)});
        shares.lines.push_back(std::move(line));
    }
    start_at_zero(shares);
    Chart errors;
    errors.title = "What P-frames cost, M2";
    errors.x_label = rate_label;
    errors.y_label = "M2, point to surface, RMS, mm";
    for (const bool check : {false, true}) {
        const auto& from = check ? checked : points;
        if (from.empty()) continue;
        ChartLine line{
            check ? "checked: bones within 2 mm" : "by motion alone", colours[check ? 2 : 0], check ? 5 : 7, 1, {}};
        for (const auto& [threshold, point] : from)
            line.points.push_back({bits_per_vertex(*point), value_of(*point, "m2_mm")});
        std::sort(line.points.begin(), line.points.end());
        errors.lines.push_back(std::move(line));
    }
    start_at_zero(errors);
    figure.charts = {draw(easel, "figure_07b_shares", shares), draw(easel, "figure_07b_errors", errors)};
    const auto &without = *points.front().second, &most = *points.back().second;
    figure.found = fmt::format(
        "Below {:g} mm, {:.0f} % of the frames are P-frames: the rate falls from {:.2f} to {:.2f} bpvf, and M2 rises "
        "from {:.2f} to {:.2f} mm.",
        points.back().first, 100 * share_of(most, FrameType::predicted), bits_per_vertex(without),
        bits_per_vertex(most), value_of(without, "m2_mm"), value_of(most, "m2_mm"));
    if (!checked.empty()) {
        const auto& with_check = *checked.back().second;
        figure.found += fmt::format(
            " Where a frame must also fit the captured surface within 2 mm, bone by bone, {:.0f} % are, at {:.2f} bpvf "
            "and {:.2f} mm.",
            100 * share_of(with_check, FrameType::predicted), bits_per_vertex(with_check),
            value_of(with_check, "m2_mm"));
    }
    figure.how = fmt::format(
        "Thresholds of {}, at equal parts of this capture's skeletal motion since the last "
        "I-frame; geometry alone, step {:.2g} mm, the paper's coder.",
        threshold_list(points), without.geometry_step);
    return figure;
}

Figure figure_17(const Findings& findings, Easel& easel) {
    Figure figure{"17",
                  "encoding and decoding times in motion-based coding",
                  "Coding the moving sub-meshes alone takes less time on both sides: the lower the rate, the less.",
                  {},
                  {}};
    const auto points = motion_points(findings);
    if (points.empty()) {
        figure.skipped = no_skeleton;
        return figure;
    }
    Chart chart;
    chart.title = "Time of a frame, by threshold on the bones' motion";
    chart.x_label = rate_label;
    chart.y_label = "ms a frame";
    ChartLine encode{"encoding", colours[0], 7, 1, {}}, decode{"decoding", colours[1], 5, 1, {}};
    for (const auto& [threshold, point] : points) {
        encode.points.push_back({bits_per_vertex(*point), encode_ms(*point)});
        decode.points.push_back({bits_per_vertex(*point), decode_ms(*point)});
    }
    chart.lines = {encode, decode};
    start_at_zero(chart);
    figure.charts.push_back(draw(easel, "figure_17", chart));
    const auto &full = *points.front().second, &least = *points.back().second;
    figure.found = fmt::format(
        "From all coded to what moves {:g} mm or more: {}, {} time to encode ({:.0f} to {:.0f} ms) and {} to "
        "decode ({:.0f} to {:.0f} ms).",
        points.back().first, rate_change(full, least), change_words(encode_ms(full), encode_ms(least)), encode_ms(full),
        encode_ms(least), change_words(decode_ms(full), decode_ms(least)), decode_ms(full), decode_ms(least));
    if (points.size() > 2) {
        const auto& first = *points[1].second;
        figure.found += fmt::format(
            " At the lowest threshold, {:g} mm, encoding takes {}: to cut the moving part, its distance to the moved "
            "I-frame is measured, and the seam is zippered.",
            points[1].first, change_words(encode_ms(full), encode_ms(first)));
    }
    figure.how = fmt::format(
        "Thresholds of {} on each bone's motion since the I-frame, at equal parts of this capture's; step {:g} mm, "
        "colour step {:g}. Means over all frames, processor time of one thread; I-frames counted.",
        threshold_list(points), full.geometry_step, full.colour_step);
    return figure;
}

Figure figure_18(const Findings& findings, Easel& easel) {
    Figure figure{"18",
                  "picture quality (M3) against bit rate in motion-based coding",
                  "PSNR falls with the rate, but the difference is hard to see where the skeleton is good.",
                  {},
                  {}};
    const auto points = motion_points(findings);
    if (points.empty()) {
        figure.skipped = no_skeleton;
        return figure;
    }
    Chart chart;
    chart.title = "Pictures, M3, by threshold on the bones' motion";
    chart.x_label = rate_label;
    chart.y_label = "PSNR, dB";
    std::vector<double> xs, ys;
    for (const bool foreground : {true, false}) {
        ChartLine line{
            foreground ? "foreground" : "full picture", colours[foreground ? 0 : 1], foreground ? 7 : 5, 1, {}};
        for (const auto& [threshold, point] : points) {
            line.points.push_back(
                {bits_per_vertex(*point), value_of(*point, foreground ? "m3_foreground_db" : "m3_full_db")});
            xs.push_back(line.points.back()[0]);
            ys.push_back(line.points.back()[1]);
        }
        chart.lines.push_back(std::move(line));
    }
    chart.x = zero_axis(xs);
    chart.y = psnr_axis(ys);
    figure.charts.push_back(draw(easel, "figure_18", chart));
    const auto &full = *points.front().second, &least = *points.back().second;
    figure.found = fmt::format(
        "From {:.2f} dB of the foreground at {:.2f} bpvf, all coded, to {:.2f} dB at {:.2f} bpvf; M2 goes from {:.2f} "
        "to {:.2f} mm.",
        value_of(full, "m3_foreground_db"), bits_per_vertex(full), value_of(least, "m3_foreground_db"),
        bits_per_vertex(least), value_of(full, "m2_mm"), value_of(least, "m2_mm"));
    figure.how = fmt::format(
        "The runs of figure 17, nothing but the threshold changed; 10 views round the body, smooth shading{}; measured "
        "on 1 frame in {}.",
        findings.has_colour ? " with colours" : "", findings.motion_every);
    return figure;
}

std::optional<Table> motion_table(const Findings& findings) {
    const auto points = motion_points(findings);
    if (points.empty()) return std::nullopt;
    Table table;
    table.title = "Motion-based coding";
    table.head = {"Coded above", "I / EP / P, %", "bpvf",      "M3 foreground dB",
                  "M3 dB",       "M2 mm",         "encode ms", "decode ms"};
    for (const auto& [threshold, point] : points) table.rows.push_back(motion_row(threshold, *point));
    table.note =
        "The paper's coder; bones that moved less than the threshold since the I-frame are animated, unchecked.";
    return table;
}

std::optional<Claim> motion_claim(const Findings& findings) {
    const auto points = motion_points(findings);
    if (points.size() < 2) return std::nullopt;
    const auto &full = *points.front().second, &some = *points[points.size() / 2].second;
    Claim claim{
        "Motion-based coding saves bits and time", "both, the more the higher the threshold",
        fmt::format("at {:g} mm: {}, {} time to encode, {} to decode, {:+.1f} dB", points[points.size() / 2].first,
                    rate_change(full, some), change_words(encode_ms(full), encode_ms(some)),
                    change_words(decode_ms(full), decode_ms(some)),
                    value_of(some, "m3_foreground_db") - value_of(full, "m3_foreground_db")),
        "in part",
        bits_per_vertex(some) < bits_per_vertex(full) && encode_ms(some) < encode_ms(full) &&
            decode_ms(some) < decode_ms(full)};
    if (claim.holds) claim.verdict = "holds";
    return claim;
}

}  // namespace htvm::lab
