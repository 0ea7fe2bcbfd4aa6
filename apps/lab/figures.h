// The paper's figures with what was measured: charts, and captions whose wording depends on the numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "charts.h"
#include "experiments.h"
#include "findings.h"
#include "page.h"
#include "results.h"

namespace htvm::lab {

// Where charts are written. Their scripts are collected, and gnuplot is run once on all.
struct Easel {
    std::filesystem::path folder;
    std::string script;
};
// Adds the chart to the script, and returns the file that it will be in.
std::filesystem::path draw(Easel& easel, const std::string& name, const Chart& chart);
std::filesystem::path draw(Easel& easel, const std::string& name, const SpaceChart& chart);

Figure figure_6(const Findings& findings, Easel& easel);
Figure figure_7(const Findings& findings, const ExperimentPlan& plan, Easel& easel);
Figure figure_7_by_motion(const Findings& findings, const ExperimentPlan& plan, Easel& easel);  // needs thresholds
Figure figure_7_predicted(const Findings& findings, Easel& easel);
Figure figure_10(const Findings& findings, Easel& easel);
Figure figure_11(const Findings& findings, const ExperimentPlan& plan, Easel& easel);
Figure figure_12(const Findings& findings, const ExperimentPlan& plan, Easel& easel);
Figure figure_13(const Findings& findings, const ExperimentPlan& plan, Easel& easel);
Figure figure_16(const Findings& findings, const ExperimentPlan& plan, Easel& easel);
Figure figure_17(const Findings& findings, Easel& easel);
Figure figure_18(const Findings& findings, Easel& easel);
Figure figure_20(const Findings& findings, Easel& easel);
Figure figure_20_of_one_camera(const Findings& findings, Easel& easel);
Figure figure_21(const InternalRun& run, Easel& easel);
Figure figure_22(const InternalRun& run, Easel& easel);
Figure figure_23(const InternalRun& run, Easel& easel);
Figure figure_24(const InternalRun& run, Easel& easel);
Figure figure_25(const InternalRun& run, Easel& easel);

// Skeleton noise compared with none: how many more bits the noisiest skeleton takes at equal error, and the largest
// change of M1 at the same steps (0.02: 2 %).
struct NoiseEffect {
    double highest_power = 0;
    std::optional<double> rate_difference;
    double largest_error_change = 0;
};
std::optional<NoiseEffect> noise_effect(std::span<const std::pair<double, std::vector<RdPoint>>> noise);

// Where the bits go at the rate at which the paper's coder and TFAN cross (or in the middle of their rates), as an
// explanation.
std::string crossing_reason(std::span<const RdPoint> points);

// Motion-based coding at each threshold, and the paper's finding next to the middle one; nothing without figure 17.
std::optional<Table> motion_table(const Findings& findings);
std::optional<Claim> motion_claim(const Findings& findings);

std::vector<Claim> claims(const Findings& findings);

// ---- Distributions over frames --------------------------------------------------------------------------------------

struct Histogram {
    double low = 0, width = 1;          // of the first bar; of every bar
    std::vector<std::uint64_t> counts;  // one per bar; the sum is the number of values
    double mean = 0;                    // of the values themselves
};

// Bars whose width is 1, 2 or 5 times a power of ten and which begin at a multiple of it: at most `most_bars` + 1, none
// narrower than `least_width`. Values that are not finite are left out. Equal values form one bar.
Histogram histogram(std::span<const double> values, int most_bars = 12, double least_width = 0);

}  // namespace htvm::lab
