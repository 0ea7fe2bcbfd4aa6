// What was measured, and what the numbers say, in words: which coder is ahead where; the report's summary, tables and
// JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "experiments.h"
#include "metrics/bjontegaard.h"
#include "page.h"
#include "results.h"

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

// ---- Which coder is ahead where
// ---------------------------------------------------------------------------------------

// The measure of that key, which must be one of measures().
const Measure& measure_of(const std::string& key);

// Two coders' curves in one measure.
struct Contest {
    std::optional<double> rate_difference;  // Bjontegaard, of the first against the second
    std::vector<CurveCrossing> crossings;
    double low = 0, high = 0;  // bpvf that both reach; low >= high: none
    int leader = 0;            // where the curves do not cross: 1 the first is ahead, 2 the second, 0 not known
};
Contest contest(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                const std::string& measure);

// Below which rate the first is ahead; nothing where it is not ahead at the lowest rates, infinite where it is ahead at
// all of them.
std::optional<double> ahead_below(const Contest& contest);

// One or two sentences with the numbers in them.
std::string contest_sentence(const Contest& contest, const std::string& first, const std::string& second,
                             const std::string& measure);
// The same in a few words, for a table's cell.
std::string contest_phrase(const Contest& contest);

// "12.3 % fewer bits", "4.0 % more bits", "as many bits", of a rate difference.
std::string bits_phrase(double rate_difference);

// The step of positions at which a coder would have the rate, between the points measured at one colour step; nothing
// outside of them.
std::optional<double> geometry_step_at_rate(std::span<const RdPoint> points, const std::string& coder, double rate);

// `count` rates that both coders reach, in equal factors from the lowest to `highest` at most; empty where they share
// none.
std::vector<double> matched_rates(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                                  int count, double highest);

// ---- The report's words and tables, and its JSON --------------------------------------------------------------------

// Paragraphs for the top of the page. `what`: the capture in words, such as "20 frames of samba".
std::vector<std::string> summary_paragraphs(const std::string& what, const Findings& findings,
                                            const std::vector<Claim>& claims);

// Rates, errors and speeds; layers of EP-frames; rate differences and crossings; colours and pictures.
std::vector<Table> result_tables(const Findings& findings);

nlohmann::json report_json(const Report& report, const Findings& findings);

}  // namespace htvm::lab
