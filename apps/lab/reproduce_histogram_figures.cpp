// Figures 21 to 25: distributions over EP-frames; and the paper's findings beside ours.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "command_line/layer_table.h"
#include "reproduce_figures.h"
#include "reproduce_findings.h"
#include "reproduce_histogram.h"

namespace htvm::lab {

using namespace app;
namespace {

constexpr const char* bar_colour = "#0072b2";
constexpr const char* mean_colour = "#222222";
constexpr const char* paper_colour = "#d55e00";

struct PaperMean {
    double value = 0;
    const char* title = "the paper's mean";
};

// Bars with the mean as a line. With the paper's mean, a dashed line, the axis starts from 0; without, it spans the
// bars.
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

std::size_t geometry_bytes(const LayerBytes& b) { return b.geometry; }
std::size_t colour_bytes(const LayerBytes& b) { return b.colour; }
std::size_t mapping_bytes(const LayerBytes& b) { return b.mapping; }
std::size_t connectivity_bytes(const LayerBytes& b) { return b.fans + b.distance_orders; }
std::size_t order_bytes(const LayerBytes& b) { return b.distance_orders; }
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
        "About 5 frames a second encoded and 12 decoded, on a Core i7 2700K with a GTX 560 that helped.",
        fmt::format("{:.0f} ms to encode ({:.1f} frames a second) and {:.0f} ms to decode ({:.1f}) on average.",
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

Claim contest_claim(const char* what, const char* paper, double least, const Contest& found) {
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
        out.push_back(contest_claim("Ahead of TFAN in M1 at low rates", "below 12 to 14 bpvf", 12,
                                    contest(findings.geometry, "paper", "tfan", "m1_mm")));
        out.push_back(contest_claim("Ahead of TFAN in M2 at low rates", "below 11 bpvf", 11,
                                    contest(findings.geometry, "paper", "tfan", "m2_mm")));
    }
    if (!findings.pictures.empty())
        out.push_back(contest_claim("Ahead of TFAN in M3 at low rates", "below 16 to 20 bpvf", 16,
                                    contest(findings.pictures, "paper", "tfan", "m3_foreground_db")));
    if (auto claim = motion_claim(findings)) out.push_back(std::move(*claim));
    if (const auto effect = noise_effect(findings)) {
        Claim claim{
            "Noise on the skeleton costs bits, not quality", "points at almost the same error",
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
        Claim speed{"Frames a second, encoded and decoded", "about 5 and 12, with a graphics card",
                    fmt::format("{:.1f} and {:.1f}, on {} processor threads", encode, decode, run.threads),
                    "slower here", encode >= 5 && decode >= 12};
        if (speed.holds) speed.verdict = "faster here";
        out.push_back(std::move(speed));
    }
    return out;
}

}  // namespace htvm::lab
