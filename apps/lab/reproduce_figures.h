// The paper's figures from what was measured: charts, and captions whose words the numbers choose.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rd_result.h"
#include "reproduce_chart.h"
#include "reproduce_figure.h"
#include "reproduce_internals.h"
#include "reproduce_motion.h"
#include "reproduce_page.h"
#include "reproduce_sweeps.h"
#include "reproduce_zipper.h"

namespace htvm::lab {

// All that was measured; what was not asked for, or cannot be, is empty.
struct Findings {
    std::vector<RdPoint> geometry;                        // 6, 10
    std::vector<RdPoint> intervals;                       // 7 without a skeleton: in the order of interval_trials()
    std::optional<MotionThresholds> thresholds;           // 7, 17 to 19; none: the capture has no skeleton
    std::vector<RdPoint> intra_choice, predicted_choice;  // 7
    std::vector<RdPoint> motion;                          // 17 and 18
    std::vector<SeamCounts> seams;                        // 19
    std::vector<RdPoint> colour;                          // 11 to 13
    std::vector<RdPoint> pictures;                        // 16
    std::vector<std::pair<double, std::vector<RdPoint>>> noise;          // 20: power and its points
    std::optional<InternalRun> internals;                                // 21 to 25
    std::size_t geometry_every = 1, colour_every = 1, motion_every = 1;  // frames measured: every so many-th
    bool true_skeleton = false;                                          // of the noise: added to the true skeleton
    bool has_colour = true;
};

// Where charts go. Their scripts gather until gnuplot is run on all.
struct Easel {
    std::filesystem::path folder;
    std::string script;
};
// The file that the chart will be in; the script grows by it.
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
Figure figure_21(const InternalRun& run, Easel& easel);
Figure figure_22(const InternalRun& run, Easel& easel);
Figure figure_23(const InternalRun& run, Easel& easel);
Figure figure_24(const InternalRun& run, Easel& easel);
Figure figure_25(const InternalRun& run, Easel& easel);

// Skeleton noise against none: how many more bits the noisiest skeleton takes at equal error, and by how much M1 at
// the same steps differs at most (0.02: 2 %).
struct NoiseEffect {
    double highest_power = 0;
    std::optional<double> rate_difference;
    double largest_error_change = 0;
};
std::optional<NoiseEffect> noise_effect(const Findings& findings);

// Where bits go at the rate where the paper's coder and TFAN cross (or in the middle of their rates): why it is there.
std::string crossing_reason(std::span<const RdPoint> points);

// Motion-based coding at each threshold, and at the middle one beside the paper's finding; nothing without figure 17.
std::optional<Table> motion_table(const Findings& findings);
std::optional<Claim> motion_claim(const Findings& findings);

std::vector<Claim> claims(const Findings& findings);

}  // namespace htvm::lab
