// What was measured, and what the numbers say in words: which coder is ahead where; the report's summary, tables and
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

// Everything that was measured; what was not asked for, or is not possible, is empty.
struct Findings {
    std::vector<RdPoint> geometry;                        // 6, 10
    std::vector<RdPoint> intervals;                       // 7 without a skeleton, in the order of interval_trials()
    std::optional<MotionThresholds> thresholds;           // 7, 17 to 19; none: the capture has no skeleton
    std::vector<RdPoint> intra_choice, predicted_choice;  // 7
    std::vector<RdPoint> motion;                          // 17 and 18
    std::vector<SeamCounts> seams;                        // 19
    std::vector<RdPoint> colour;                          // 11 to 13
    std::vector<RdPoint> pictures;                        // 16
    std::vector<std::pair<double, std::vector<RdPoint>>> noise;          // 20: power, and its points
    std::vector<std::pair<double, std::vector<RdPoint>>> camera_noise;   // 20: likewise, of one depth camera's capture
    std::string camera_capture;                                          // what that is, in words
    std::optional<InternalRun> internals;                                // 21 to 25
    std::size_t geometry_every = 1, colour_every = 1, motion_every = 1;  // every n-th frame was measured
    bool true_skeleton = false;                                          // whether the noise was added to the true
                                                                         // skeleton
    bool has_colour = true;
};

// ---- Which coder is ahead where -------------------------------------------------------------------------------------

// The measure with that key, which must be one of measures().
const Measure& measure_of(const std::string& key);

// Two coders' curves in one measure.
struct Contest {
    std::optional<double> rate_difference;  // Bjontegaard, of the first relative to the second
    std::vector<CurveCrossing> crossings;
    double low = 0, high = 0;  // bpvf that both reach; low >= high: no common range
    int leader = 0;            // if the curves do not cross: 1 the first is ahead, 2 the second, 0 unknown
};
Contest contest(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                const std::string& measure);

// The rate below which the first is ahead; nothing if it is not ahead at the lowest rates, infinite if it is ahead at
// all of them.
std::optional<double> ahead_below(const Contest& contest);

// One or two sentences that include the numbers.
std::string contest_sentence(const Contest& contest, const std::string& first, const std::string& second,
                             const std::string& measure);
// The same in a few words, for a table cell.
std::string contest_phrase(const Contest& contest);

// "12.3 % fewer bits", "4.0 % more bits", "as many bits", from a rate difference.
std::string bits_phrase(double rate_difference);

// The position step at which a coder would have the rate, interpolated between the points measured at one colour step;
// nothing outside their range.
std::optional<double> geometry_step_at_rate(std::span<const RdPoint> points, const std::string& coder, double rate);

// `count` rates that both coders reach, spaced by equal factors, from the lowest to at most `highest`; empty if they
// share none.
std::vector<double> matched_rates(std::span<const RdPoint> points, const std::string& first, const std::string& second,
                                  int count, double highest);

// ---- The report's text and tables, and its JSON ---------------------------------------------------------------------

// Paragraphs for the top of the page. `what`: a description of the capture, such as "20 frames of samba".
std::vector<std::string> summary_paragraphs(const std::string& what, const Findings& findings,
                                            const std::vector<Claim>& claims);

// Rates, errors and speeds; layers of EP-frames; rate differences and crossings; colours and pictures.
std::vector<Table> result_tables(const Findings& findings);

nlohmann::json report_json(const Report& report, const Findings& findings);

}  // namespace htvm::lab
