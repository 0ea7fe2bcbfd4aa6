#include "figures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "command_line/layer_table.h"
#include "findings.h"

namespace htvm::lab {

using namespace app;

// ---- Distributions over frames --------------------------------------------------------------------------------------

Histogram histogram(std::span<const double> values, int most_bars, double least_width) {
    std::vector<double> finite;
    for (const double value : values)
        if (std::isfinite(value)) finite.push_back(value);
    Histogram out;
    if (finite.empty()) return out;
    const auto [low, high] = std::minmax_element(finite.begin(), finite.end());
    const double largest = std::max(std::abs(*low), std::abs(*high));
    // Values that differ by less than a thousandth of their size form one bar, a hundredth of it wide.
    double rough = (*high - *low) / std::max(most_bars, 1);
    if (rough <= 1e-3 * largest / std::max(most_bars, 1)) rough = largest > 0 ? 1e-2 * largest : 1;
    rough = std::max(rough, least_width);
    const double power = std::pow(10, std::floor(std::log10(rough)));
    out.width = 10 * power;
    for (const double factor : {5.0, 2.0, 1.0})
        if (factor * power >= rough * (1 - 1e-9)) out.width = factor * power;
    const double first = std::floor(*low / out.width + 1e-9);
    out.low = first * out.width;
    for (const double value : finite) {
        const auto bar = static_cast<std::size_t>(std::max(0.0, std::floor(value / out.width + 1e-9) - first));
        if (bar >= out.counts.size()) out.counts.resize(bar + 1, 0);
        ++out.counts[bar];
        out.mean += value / static_cast<double>(finite.size());
    }
    return out;
}

// ---- Curves: figures 6, 7, 10 to 13, 16 and 20 ----------------------------------------------------------------------

namespace {

constexpr const char* rate_label = "bits per captured vertex and frame (bpvf)";
constexpr const char* no_colour = "the capture has no colours.";

std::string every_words(std::size_t every) {
    return every == 1 ? std::string("errors are measured on every frame")
                      : fmt::format("errors are measured on 1 frame in {}", every);
}

Chart curves(std::span<const RdPoint> points, const std::string& measure, const std::string& title) {
    Chart chart;
    chart.title = title;
    chart.x_label = rate_label;
    const auto& m = measure_of(measure);
    chart.y_label = fmt::format("{}, {}", m.title, m.unit);
    for (const char* coder : {"paper", "htvm-ep", "tfan", "tfan-mpeg", "draco10"}) {
        auto line = line_of(points, coder, measure);
        if (!line.points.empty()) chart.lines.push_back(std::move(line));
    }
    fit_axes(chart, m.is_error);
    return chart;
}

std::string against_peers(std::span<const RdPoint> points, const std::string& measure) {
    std::string out = contest_sentence(contest(points, "paper", "tfan", measure), "paper", "tfan", measure);
    const auto published = contest(points, "paper", "tfan-mpeg", measure);
    if (published.rate_difference) out += " " + contest_sentence(published, "paper", "tfan-mpeg", measure);
    for (const char* coder : {"paper", "tfan", "htvm-ep"}) {
        const auto against = contest(points, coder, "draco10", measure);
        if (against.rate_difference)
            out += fmt::format("{} {} takes {}", coder == std::string("paper") ? " Against Draco at equal error," : ",",
                               look_of_coder(coder).name, bits_phrase(*against.rate_difference));
    }
    return out + ".";
}

std::vector<RdPoint> with_steps(std::span<const RdPoint> points, double geometry, double colour) {
    std::vector<RdPoint> out;
    for (const auto& point : points)
        if ((geometry <= 0 || point.geometry_step == geometry) && (colour <= 0 || point.colour_step == colour))
            out.push_back(point);
    return out;
}

std::string range_words(std::span<const RdPoint> points, const std::string& measure) {
    double low = 1e300, high = 0;
    for (const auto& point : points) {
        const auto value = point.values.find(measure);
        if (value == point.values.end()) continue;
        low = std::min(low, value->second);
        high = std::max(high, value->second);
    }
    const auto& m = measure_of(measure);
    return fmt::format("{:.{}f} to {:.{}f} {}", low, m.digits, high, m.digits, m.unit);
}

// Plane sections: each coder's curve, once for every value held fixed.
Figure section(std::span<const RdPoint> points, const std::vector<double>& fixed, bool colour_fixed, Figure figure,
               const std::string& name, Easel& easel) {
    const std::string measure = colour_fixed ? "m1_mm" : "m1_colour", other = colour_fixed ? "m1_colour" : "m1_mm";
    const auto& m = measure_of(measure);
    Chart chart;
    chart.title = figure.title;
    chart.x_label = rate_label;
    chart.y_label = fmt::format("{}, {}", m.title, m.unit);
    int dash = 1;
    for (const double step : fixed) {
        const auto part = with_steps(points, colour_fixed ? 0 : step, colour_fixed ? step : 0);
        if (part.empty()) continue;
        const std::string what =
            colour_fixed ? fmt::format("colour step {:g}", step) : fmt::format("geometry step {:g} mm", step);
        for (const char* coder : {"paper", "tfan", "draco10"}) {
            auto line = line_of(part, coder, measure);
            line.title += ", " + what;
            line.dash = dash;
            if (!line.points.empty()) chart.lines.push_back(std::move(line));
        }
        const auto found = contest(part, "paper", "tfan", measure);
        figure.found += fmt::format("{}At {} ({} {}): {}", figure.found.empty() ? "" : " ", what,
                                    colour_fixed ? "colour errors" : "geometry errors", range_words(part, other),
                                    contest_sentence(found, "paper", "tfan", measure));
        ++dash;
    }
    fit_axes(chart, true);
    chart.height = 540;
    chart.key += " maxrows 3";
    figure.charts.push_back(draw(easel, name, chart));
    return figure;
}

}  // namespace

std::filesystem::path draw(Easel& easel, const std::string& name, const Chart& chart) {
    auto path = easel.folder / (name + ".svg");
    easel.script += chart_script(chart, path);
    return path;
}

std::filesystem::path draw(Easel& easel, const std::string& name, const SpaceChart& chart) {
    auto path = easel.folder / (name + ".svg");
    easel.script += chart_script(chart, path);
    return path;
}

Figure figure_6(const Findings& findings, Easel& easel) {
    Figure figure{
        "6", "geometry error (M1) against bit rate",
        "The paper's coder is ahead of MPEG-4 TFAN below 12 bpvf on two sequences and below 14 on two others; "
        "above, the static coder is level or ahead.",
        against_peers(findings.geometry, "m1_mm"),
        fmt::format("Geometry and connectivity alone, I-frames counted; {}. {}", every_words(findings.geometry_every),
                    crossing_reason(findings.geometry))};
    figure.charts.push_back(draw(easel, "figure_06", curves(findings.geometry, "m1_mm", "Geometry, M1")));
    return figure;
}

Figure figure_7(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{"7",
                  "share of I-frames and bit rate",
                  "The more frames are I-frames, the higher the rate; the paper chooses I-frames by a threshold on the "
                  "skeleton's motion, 400 to 500 mm.",
                  {},
                  "The capture has no skeleton whose motion could choose: an I-frame comes at fixed intervals, and "
                  "the interval varies. Geometry alone, the same steps for all points of a line."};
    Chart chart;
    chart.title = "Share of I-frames, by the interval between them";
    chart.x_label = rate_label;
    chart.y_label = "I-frames, % of frames";
    const char* colours[] = {"#0072b2", "#cc79a7", "#009e73"};
    std::vector<double> xs, ys;
    for (std::size_t q = 0; q < plan.interval_qualities.size(); ++q) {
        ChartLine line{{}, colours[q % 3], q % 2 == 0 ? 7 : 5, 1, {}};
        for (const auto& point : findings.intervals) {
            if (point.quality != plan.interval_qualities[q]) continue;
            line.title = fmt::format("step {:.2g} mm", point.geometry_step);
            line.points.push_back(
                {bits_per_vertex(point), 100.0 * static_cast<double>(totals(point, FrameType::intra).frames) /
                                             static_cast<double>(point.frames.size())});
            xs.push_back(line.points.back()[0]);
            ys.push_back(line.points.back()[1]);
        }
        if (line.points.empty()) continue;
        const auto &all_intra = line.points.front(), &fewest = line.points.back();
        figure.found += fmt::format(
            "{}At a step of {} I-frames alone take {:.2f} bpvf and one I-frame in {:.0f} takes {:.2f}: {}.",
            figure.found.empty() ? "" : " ", line.title.substr(5), all_intra[0], 100 / fewest[1], fewest[0],
            fewest[0] < all_intra[0] ? "EP-frames save bits" : "EP-frames cost more bits than I-frames at this step");
        std::sort(line.points.begin(), line.points.end());
        chart.lines.push_back(std::move(line));
    }
    chart.x = zero_axis(xs);
    chart.y = zero_axis(ys);
    figure.charts.push_back(draw(easel, "figure_07", chart));
    return figure;
}

Figure figure_10(const Findings& findings, Easel& easel) {
    Figure figure{"10", "surface error (M2) against bit rate",
                  "The paper's coder is ahead of TFAN up to 11 bpvf; the margin is narrower than in M1, since vectors "
                  "are quantised for the points' error, not the surface's.",
                  against_peers(findings.geometry, "m2_mm"),
                  fmt::format("The same frames as figure 6, geometry alone; {}; M2 as METRO computes it, both "
                              "directions, the larger one.",
                              every_words(findings.geometry_every))};
    figure.charts.push_back(draw(easel, "figure_10", curves(findings.geometry, "m2_mm", "Surface, M2")));
    return figure;
}

Figure figure_11(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{
        "11",
        "geometry and colour error against bit rate",
        "With colours coded too, the paper's coder is ahead of TFAN at low rates, over a wider range than with "
        "geometry alone.",
        {},
        "Each point is one pair of steps; lines join points of one geometry or one colour step."};
    if (!findings.has_colour) {
        figure.skipped = no_colour;
        return figure;
    }
    SpaceChart chart;
    chart.title = "Geometry and colour, M1";
    chart.x_label = "geometry, mm (log scale)";
    chart.y_label = "colour, levels";
    chart.z_label = "bpvf";
    for (const char* coder : {"paper", "tfan"}) {
        const auto look = look_of_coder(coder);
        SpaceChart::Series series{look.name, look.colour, look.mark, {}};
        auto add = [&](const std::vector<RdPoint>& part) {
            std::vector<std::array<double, 3>> row;
            for (const auto& point : part)
                if (point.coder == coder && point.values.contains("m1_mm") && point.values.contains("m1_colour"))
                    row.push_back({point.values.at("m1_mm"), point.values.at("m1_colour"), bits_per_vertex(point)});
            if (row.size() > 1) series.rows.push_back(std::move(row));
        };
        for (const double step : plan.colour_columns) add(with_steps(findings.colour, 0, step));
        for (const double step : plan.geometry_rows) add(with_steps(findings.colour, step, 0));
        if (!series.rows.empty()) chart.series.push_back(std::move(series));
    }
    std::size_t ahead = 0, pairs = 0;
    for (const auto& ours : findings.colour) {
        if (ours.coder != "paper") continue;
        for (const auto& theirs : findings.colour) {
            if (theirs.coder != "tfan" || theirs.geometry_step != ours.geometry_step ||
                theirs.colour_step != ours.colour_step)
                continue;
            ++pairs;
            if (bits_per_vertex(ours) < bits_per_vertex(theirs)) ++ahead;
        }
    }
    figure.found = fmt::format(
        "The paper's coder takes fewer bits than TFAN at {} of {} pairs of equal steps (whose "
        "errors are close, not equal: figures 12 and 13 compare at equal error).",
        ahead, pairs);
    figure.charts.push_back(draw(easel, "figure_11", chart));
    return figure;
}

Figure figure_12(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{
        "12",
        "geometry error against bit rate, colour error alike",
        "At similar colour error the paper's coder is ahead of TFAN at lower rates and behind at higher ones.",
        {},
        fmt::format("The rate is that of geometry, connectivity and colour together; {}.",
                    every_words(findings.colour_every))};
    if (!findings.has_colour) {
        figure.skipped = no_colour;
        return figure;
    }
    return section(findings.colour, plan.colour_columns, true, std::move(figure), "figure_12", easel);
}

Figure figure_13(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    Figure figure{"13",
                  "colour error against bit rate, geometry error alike",
                  "At similar geometry error the paper's coder is ahead of TFAN at lower rates and behind at higher "
                  "ones.",
                  {},
                  fmt::format("The rate is that of geometry, connectivity and colour together; {}.",
                              every_words(findings.colour_every))};
    if (!findings.has_colour) {
        figure.skipped = no_colour;
        return figure;
    }
    return section(findings.colour, plan.geometry_rows, false, std::move(figure), "figure_13", easel);
}

Figure figure_16(const Findings& findings, const ExperimentPlan& plan, Easel& easel) {
    const std::string shading = findings.has_colour
                                    ? fmt::format("smooth shading, with colours (step {:g})", plan.picture_colour_step)
                                    : std::string("smooth shading, without colours");
    Figure figure{
        "16", "picture quality (M3) against bit rate",
        "Ahead of TFAN up to 16 bpvf on one sequence, then level up to 19; up to 20 bpvf on the other.",
        against_peers(findings.pictures, "m3_foreground_db"),
        fmt::format("10 views around the body at 1280 x 1024, {}; PSNR of the foreground, on 1 frame in {}; the "
                    "geometry step varies. The paper does not say whether its PSNR counts the background.",
                    shading, plan.picture_every)};
    figure.charts.push_back(draw(easel, "figure_16", curves(findings.pictures, "m3_foreground_db", "Pictures, M3")));
    return figure;
}

std::optional<NoiseEffect> noise_effect(std::span<const std::pair<double, std::vector<RdPoint>>> noise) {
    if (noise.size() < 2) return std::nullopt;
    const auto &clean = noise.front().second, &worst = noise.back().second;
    NoiseEffect out;
    out.highest_power = noise.back().first;
    const auto& m1 = measure_of("m1_mm");
    out.rate_difference = bjontegaard_rate_difference(rate_curve(clean, "paper", m1), rate_curve(worst, "paper", m1));
    for (std::size_t i = 0; i < std::min(clean.size(), worst.size()); ++i) {
        const auto a = clean[i].values.find("m1_mm"), b = worst[i].values.find("m1_mm");
        if (a == clean[i].values.end() || b == worst[i].values.end() || !(a->second > 0)) continue;
        out.largest_error_change = std::max(out.largest_error_change, std::abs(b->second / a->second - 1));
    }
    return out;
}

namespace {

constexpr const char* noise_finding =
    "Noise of 20, 40, 60 and 80 mm² on each joint coordinate costs bits but not quality: points of the same settings "
    "lie at almost the same error.";
constexpr const char* noise_on_the_truth =
    "White Gaussian noise of the given power on each coordinate of the true skeleton's joints, geometry alone, the "
    "paper's coder.";

void add_noise_chart(Figure& figure, std::span<const std::pair<double, std::vector<RdPoint>>> noise,
                     const std::string& name, Easel& easel) {
    Chart chart;
    chart.title = "Noise on the skeleton, M1";
    chart.x_label = rate_label;
    chart.y_label = "M1, vertex to vertex, RMS, mm";
    const char* colours[] = {"#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00"};
    const int marks[] = {7, 5, 9, 13, 11};
    for (std::size_t i = 0; i < noise.size(); ++i) {
        auto line = line_of(noise[i].second, "paper", "m1_mm");
        line.title = fmt::format("{:g} mm²", noise[i].first);
        line.colour = colours[i % 5];
        line.mark = marks[i % 5];
        chart.lines.push_back(std::move(line));
    }
    fit_axes(chart, true);
    figure.charts.push_back(draw(easel, name, chart));
    if (const auto effect = noise_effect(noise)) {
        figure.found = fmt::format(
            "{} at {:g} mm² than with no added noise at equal error, and M1 at the same steps differs by {:.1f} % at "
            "most.",
            effect->rate_difference ? bits_phrase(*effect->rate_difference) : "Not comparable", effect->highest_power,
            100 * effect->largest_error_change);
        const bool robust = effect->largest_error_change < 0.1;
        figure.found +=
            robust ? " So it is here: errors stay, the rate pays." : " Errors change more than in the paper.";
    }
}

}  // namespace

Figure figure_20(const Findings& findings, Easel& easel) {
    Figure figure{"20",
                  "geometry error (M1) against bit rate, for skeletons of less and less quality",
                  noise_finding,
                  {},
                  findings.true_skeleton
                      ? noise_on_the_truth
                      : "White Gaussian noise of the given power added to the tracked skeleton, which has an error of "
                        "its own; geometry alone, the paper's coder."};
    if (findings.noise.empty())
        figure.skipped = "the capture has no skeleton to add noise to.";
    else
        add_noise_chart(figure, findings.noise, "figure_20", easel);
    return figure;
}

Figure figure_20_of_one_camera(const Findings& findings, Easel& easel) {
    Figure figure{"20b",
                  "the same of what one depth camera sees, as in the paper's \"Alex\"",
                  noise_finding,
                  {},
                  fmt::format("Not this capture, but a synthetic one as the paper's is: {}, pixels joined where their "
                              "depths differ little. {}",
                              findings.camera_capture, noise_on_the_truth)};
    add_noise_chart(figure, findings.camera_noise, "figure_20b", easel);
    return figure;
}

std::string crossing_reason(std::span<const RdPoint> points) {
    const auto found = contest(points, "paper", "tfan", "m1_mm");
    const double rate = found.crossings.empty() ? std::sqrt(std::max(found.low, 0.1) * std::max(found.high, 0.1))
                                                : found.crossings.front().rate;
    const RdPoint* ours = nullptr;
    for (const auto& point : points)
        if (point.coder == "paper" && (!ours || std::abs(std::log(bits_per_vertex(point) / rate)) <
                                                    std::abs(std::log(bits_per_vertex(*ours) / rate))))
            ours = &point;
    if (!ours) return {};
    const auto sums = totals(*ours, FrameType::enhanced);
    for (const auto& point : points) {
        if (point.coder != "tfan" || point.quality != ours->quality || sums.frames == 0) continue;
        const auto other = totals(point);
        auto bpv = [](std::size_t bytes, const LayerTotals& of) {
            return app::bits_per_vertex(bytes, of.source_vertices);
        };
        return fmt::format(
            "{}: with a step of {:.2g} mm an EP-frame's residuals take {:.2f} bpv and TFAN's positions {:.2f}, "
            "but the EP-frame also sends the mapping ({:.2f}) and the distance orders ({:.2f}), and fans of {:.2f} "
            "where TFAN takes {:.2f} for connectivity. The paper's TFAN took about 3.4 (its 4.7 less 1.3): the more "
            "expensive "
            "the static coder, the higher the rate where the curves cross.",
            found.crossings.empty() ? "Where the bits go" : "Why there", ours->geometry_step,
            bpv(sums.bytes[Layer::geometry], sums), bpv(other.bytes[Layer::geometry], other),
            bpv(sums.bytes[Layer::mapping], sums), bpv(sums.bytes[Layer::distance_orders], sums),
            bpv(sums.bytes[Layer::fans], sums), bpv(other.bytes[Layer::fans], other));
    }
    return {};
}

// ---- Distributions: figures 21 to 25; and all claims ----------------------------------------------------------------

namespace {

constexpr const char* bar_colour = "#0072b2";
constexpr const char* mean_colour = "#222222";
constexpr const char* paper_colour = "#d55e00";

struct PaperMean {
    double value = 0;
    const char* title = "the paper's mean";
};

// Bars with the mean as a line. If the paper's mean is given, as a dashed line, the axis starts at 0; otherwise it
// spans the bars.
Chart distribution(const std::vector<double>& values, const std::string& title, const std::string& unit,
                   std::optional<PaperMean> paper, int digits) {
    double largest = paper ? paper->value : 0;
    for (const double value : values) largest = std::max(largest, value);
    const auto bars = histogram(values, 12, paper ? 0.02 * largest : 0);
    Chart chart;
    chart.title = title;
    chart.x_label = unit;
    chart.y_label = "frames";
    chart.width = 520;
    chart.height = 380;
    chart.bar_width = bars.width;
    ChartLine line{{}, bar_colour, 7, 1, {}};
    const double end = bars.low + bars.width * static_cast<double>(bars.counts.size());
    std::vector<double> ys;
    for (std::size_t i = 0; i < bars.counts.size(); ++i) {
        ys.push_back(static_cast<double>(bars.counts[i]));
        line.points.push_back({bars.low + bars.width * (static_cast<double>(i) + 0.5), ys.back()});
    }
    chart.lines.push_back(std::move(line));
    chart.rules.push_back({bars.mean, fmt::format("mean {:.{}f}", bars.mean, digits), mean_colour, 1});
    if (paper) {
        chart.rules.push_back({paper->value, fmt::format("{} {:g}", paper->title, paper->value), paper_colour, 2});
        chart.x = zero_axis(std::vector<double>{end, paper->value});
    } else {
        chart.x.low = bars.low - bars.width;
        chart.x.high = end + bars.width;
    }
    chart.y = zero_axis(ys);
    std::erase_if(chart.y.tics, [](double tic) { return tic != std::floor(tic); });
    return chart;
}

std::string at_rate(const InternalRun& run) {
    std::size_t enhanced = 0;
    for (const auto& frame : run.frames) enhanced += frame.info.type == FrameType::enhanced ? 1 : 0;
    return fmt::format(
        "{} EP-frames of the paper's coder at quality {:g} (steps of {:.2g} mm and {:.0f} levels), {:.1f} bpvf in all; "
        "the "
        "paper: 400 frames at 13.2 bpvf.",
        enhanced, run.quality, run.geometry_step, run.colour_step, run.bits_per_vertex);
}

std::size_t geometry_bytes(const LayerBytes& b) { return b[Layer::geometry]; }
std::size_t colour_bytes(const LayerBytes& b) { return b[Layer::colour]; }
std::size_t mapping_bytes(const LayerBytes& b) { return b[Layer::mapping]; }
std::size_t connectivity_bytes(const LayerBytes& b) { return b[Layer::fans] + b[Layer::distance_orders]; }
std::size_t order_bytes(const LayerBytes& b) { return b[Layer::distance_orders]; }
std::size_t all_bytes(const LayerBytes& b) { return b.total(); }

std::string beside(const char* what, double here, double paper) {
    return fmt::format("{} {:.2f} bpv on average; the paper {:.1f}", what, here, paper);
}

std::vector<double> times(const InternalRun& run, bool encode) {
    std::vector<double> out;
    for (const auto& frame : run.frames)
        if (frame.info.type == FrameType::enhanced) out.push_back(encode ? frame.encode_ms : frame.decode_ms);
    return out;
}

double fps_of(const std::vector<double>& milliseconds) {
    const double mean = mean_of(milliseconds);
    return mean > 0 ? 1000 / mean : 0;
}

}  // namespace

Figure figure_21(const InternalRun& run, Easel& easel) {
    const auto geometry = layer_rates(run, geometry_bytes), colour = layer_rates(run, colour_bytes);
    Figure figure{"21", "rates of geometry and colour", "Histograms of both layers over 400 frames.", {}, at_rate(run)};
    figure.found = fmt::format("Geometry takes {:.2f} bpv on average", mean_of(geometry));
    figure.charts.push_back(
        draw(easel, "figure_21_geometry", distribution(geometry, "Geometry", "bits per vertex", std::nullopt, 2)));
    if (mean_of(colour) > 0) {
        figure.found += fmt::format(", colour {:.2f}", mean_of(colour));
        figure.charts.push_back(
            draw(easel, "figure_21_colour", distribution(colour, "Colour", "bits per vertex", std::nullopt, 2)));
    } else {
        figure.found += "; the capture has no colours";
    }
    figure.found += ".";
    return figure;
}

Figure figure_22(const InternalRun& run, Easel& easel) {
    const auto mapping = layer_rates(run, mapping_bytes), connectivity = layer_rates(run, connectivity_bytes);
    Figure figure{"22",
                  "rates of mapping and connectivity",
                  "The mapping takes 1.6 bits per vertex on average, connectivity 4.7.",
                  {},
                  at_rate(run)};
    figure.found = beside("The mapping takes", mean_of(mapping), 1.6) + ". " +
                   beside("Connectivity, distance orders included, takes", mean_of(connectivity), 4.7) + ".";
    figure.charts.push_back(
        draw(easel, "figure_22_mapping", distribution(mapping, "Mapping", "bits per vertex", PaperMean{1.6}, 2)));
    figure.charts.push_back(draw(easel, "figure_22_connectivity",
                                 distribution(connectivity, "Connectivity", "bits per vertex", PaperMean{4.7}, 2)));
    return figure;
}

Figure figure_23(const InternalRun& run, Easel& easel) {
    const auto rates = layer_rates(run, order_bytes);
    const auto& counts = run.distance_order_counts;
    Figure figure{"23",
                  "distance orders",
                  "The values are distributed as M-TFAN was designed for; coding them costs about 1.3 bits per vertex.",
                  {},
                  at_rate(run)};
    const auto sum = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    if (sum > 0) {
        Chart chart;
        chart.title = fmt::format("Distance orders inside frame {}", run.order_frame);
        chart.x_label = "distance order";
        chart.y_label = "% of those coded";
        chart.width = 520;
        chart.height = 360;
        chart.bar_width = 0.8;
        chart.key = {};
        ChartLine line{{}, bar_colour, 7, 1, {}};
        std::vector<double> shares;
        for (std::size_t i = 0; i < counts.size(); ++i) {
            shares.push_back(100 * static_cast<double>(counts[i]) / static_cast<double>(sum));
            line.points.push_back({static_cast<double>(i), shares.back()});
        }
        chart.lines.push_back(std::move(line));
        chart.x_label += fmt::format(" ({}: not among the nearest)", counts.size() - 1);
        chart.x.low = -0.7;
        chart.x.high = static_cast<double>(counts.size()) - 0.3;
        const std::size_t stride = counts.size() > 20 ? 4 : counts.size() > 10 ? 2 : 1;
        for (std::size_t i = 0; i < counts.size(); i += stride) chart.x.tics.push_back(static_cast<double>(i));
        chart.y = zero_axis(shares);
        figure.charts.push_back(draw(easel, "figure_23_orders", chart));
        figure.found = fmt::format(
            "{:.0f} % of the distance orders in frame {} are 0, {:.0f} % are 0 to 3. ", shares[0], run.order_frame,
            std::accumulate(shares.begin(), shares.begin() + std::min<std::ptrdiff_t>(4, std::ssize(shares)), 0.0));
    }
    figure.found += beside("Distance orders take", mean_of(rates), 1.3) + ".";
    figure.charts.push_back(draw(easel, "figure_23_rate",
                                 distribution(rates, "Distance orders' rate", "bits per vertex", PaperMean{1.3}, 2)));
    return figure;
}

Figure figure_24(const InternalRun& run, Easel& easel) {
    const auto rates = layer_rates(run, all_bytes);
    Figure figure{"24",
                  "total rate of EP-frames",
                  "The total rate's distribution at a mean of 13.2 bpvf.",
                  {},
                  at_rate(run) + " The rate was chosen near the paper's among qualities 20, 25 ... 95."};
    const auto [low, high] = std::minmax_element(rates.begin(), rates.end());
    auto wide = distribution(rates, "All of an EP-frame", "bits per vertex", std::nullopt, 2);
    wide.width = 640;
    if (!rates.empty())
        figure.found =
            fmt::format("EP-frames take {:.2f} bpv on average, from {:.2f} to {:.2f}.", mean_of(rates), *low, *high);
    figure.charts.push_back(draw(easel, "figure_24", wide));
    return figure;
}

Figure figure_25(const InternalRun& run, Easel& easel) {
    const auto encode = times(run, true), decode = times(run, false);
    Figure figure{
        "25", "time to encode and decode an EP-frame",
        "About 5 frames per second encoded and 12 decoded, on a Core i7 2700K with a GTX 560 that helped.",
        fmt::format("{:.0f} ms to encode ({:.1f} frames per second) and {:.0f} ms to decode ({:.1f}) on average.",
                    mean_of(encode), fps_of(encode), mean_of(decode), fps_of(decode)),
        fmt::format("Wall clock, {} threads, no graphics card; whatever else the machine was doing counts too.",
                    run.threads)};
    std::string stages;
    for (const auto& stage : run.stages)
        stages += fmt::format("{}{} {:.1f}", stages.empty() ? "" : ", ", stage.stage, stage.milliseconds);
    if (!stages.empty()) figure.how += " Encoding by stage, ms: " + stages + ".";
    figure.charts.push_back(
        draw(easel, "figure_25_encode", distribution(encode, "Encoding", "ms", PaperMean{200, "the paper, about"}, 0)));
    figure.charts.push_back(
        draw(easel, "figure_25_decode", distribution(decode, "Decoding", "ms", PaperMean{83, "the paper, about"}, 0)));
    return figure;
}

namespace {

Claim contest_claim(const std::string& what, const char* paper, double least, const Contest& found) {
    const auto below = ahead_below(found);
    Claim claim{what, paper, contest_phrase(found), "not here", false};
    if (found.rate_difference) claim.here += fmt::format("; {} over all", bits_phrase(*found.rate_difference));
    claim.holds = below && *below >= least;
    if (claim.holds)
        claim.verdict = std::isinf(*below) && found.high < least ? "holds, as far as measured" : "holds";
    else if (below)
        claim.verdict = "over a narrower range";
    return claim;
}

Claim rate_claim(const char* what, double paper, double here) {
    Claim claim{what, fmt::format("{:.1f} bpv", paper), fmt::format("{:.2f} bpv", here), "costs more", here <= paper};
    if (claim.holds) claim.verdict = here < 0.9 * paper ? "cheaper here" : "holds";
    return claim;
}

}  // namespace

std::vector<Claim> claims(const Findings& findings) {
    std::vector<Claim> out;
    if (!findings.geometry.empty()) {
        // The paper's own terms first: its TFAN was MPEG-4's. Ours codes the same fans in fewer bits.
        for (const char* peer : {"tfan-mpeg", "tfan"}) {
            const std::string name = look_of_coder(peer).name;
            const auto m1 = contest(findings.geometry, "paper", peer, "m1_mm");
            const auto m2 = contest(findings.geometry, "paper", peer, "m2_mm");
            out.push_back(contest_claim("Ahead of " + name + " in M1 at low rates", "below 12 to 14 bpvf", 12, m1));
            out.push_back(contest_claim("Ahead of " + name + " in M2 at low rates", "below 11 bpvf", 11, m2));
        }
    }
    if (!findings.pictures.empty())
        out.push_back(contest_claim("Ahead of TFAN in M3 at low rates", "below 16 to 20 bpvf", 16,
                                    contest(findings.pictures, "paper", "tfan", "m3_foreground_db")));
    if (auto claim = motion_claim(findings)) out.push_back(std::move(*claim));
    for (const bool of_camera : {false, true}) {
        const auto effect = noise_effect(of_camera ? findings.camera_noise : findings.noise);
        if (!effect) continue;
        Claim claim{
            of_camera ? "The same of one depth camera's capture" : "Noise on the skeleton costs bits, not quality",
            "points at almost the same error",
            fmt::format("at {:g} mm²: {}, error within {:.1f} %", effect->highest_power,
                        effect->rate_difference ? bits_phrase(*effect->rate_difference) : "rates not comparable",
                        100 * effect->largest_error_change),
            "errors change", effect->largest_error_change < 0.1};
        if (claim.holds) claim.verdict = "holds";
        out.push_back(std::move(claim));
    }
    if (findings.internals) {
        const auto& run = *findings.internals;
        const auto mapping = layer_rates(run, mapping_bytes);
        if (mapping.empty()) return out;
        out.push_back(rate_claim("Mapping's rate", 1.6, mean_of(mapping)));
        out.push_back(rate_claim("Connectivity's rate", 4.7, mean_of(layer_rates(run, connectivity_bytes))));
        out.push_back(rate_claim("Distance orders' rate", 1.3, mean_of(layer_rates(run, order_bytes))));
        const double encode = fps_of(times(run, true)), decode = fps_of(times(run, false));
        Claim speed{"Frames per second, encoded and decoded", "about 5 and 12, with a graphics card",
                    fmt::format("{:.1f} and {:.1f}, on {} processor threads", encode, decode, run.threads),
                    "slower here", encode >= 5 && decode >= 12};
        if (speed.holds) speed.verdict = "faster here";
        out.push_back(std::move(speed));
    }
    return out;
}

}  // namespace htvm::lab
