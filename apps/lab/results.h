// The results of the sweep for one coder at one quality, and the measures that tables and curves show.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "command_line/layer_table.h"
#include "htvm/frame.hpp"
#include "metrics/bjontegaard.h"
#include "metrics/compare.h"

namespace htvm::lab {

// A measure of the decoded sequence.
struct Measure {
    const char* key;    // in JSON, CSV and file names
    const char* title;  // for the axis of a curve
    const char* brief;  // for the column of a table
    const char* unit;
    const char* metric;  // the entry of --metrics that includes it
    bool is_error;       // smaller is better; else a PSNR or SSIM
    bool is_curve;       // drawn as a curve, and compared by rate differences
    int digits;          // after the decimal point, in tables
};
std::span<const Measure> measures();

struct RdFrame {
    FrameType type = FrameType::intra;
    std::uint32_t vertices = 0;  // of the captured mesh
    LayerBytes bytes;
    double encode_ms = 0;
    std::optional<double> decode_ms;
    double recoded = 1;                                   // CodedFrame::recoded
    std::optional<double> m1_mm, m2_mm, worst_region_mm;  // set if the frame was measured
    std::optional<double> covered_region_mm;              // its worst region over what is covered; if there is one
};

struct RdPoint {
    std::string coder;
    double quality = 0, geometry_step = 0, colour_step = 0;
    std::string setting;  // the quality in the coder's own terms, if it has any
    double fps = 30;
    std::vector<RdFrame> frames;
    std::map<std::string, double> values;  // by Measure::key; measures that were not taken are missing
};

// Sums over all frames, or over those of one type.
app::LayerTotals totals(const RdPoint& point);
app::LayerTotals totals(const RdPoint& point, FrameType type);

double bits_per_vertex(const RdPoint& point);  // bpvf: all bits over all captured vertices
double megabits_per_second(const RdPoint& point);
double encode_fps(const RdPoint& point);                 // frames per second
std::optional<double> decode_fps(const RdPoint& point);  // nothing if decoding was not timed separately

// A coder's curve for a measure, with larger quality for better (errors by quality_of_error).
std::vector<RatePoint> rate_curve(std::span<const RdPoint> points, const std::string& coder, const Measure& measure);

// Writes the measures of a summary that `options` asked for into `values`; infinite ones are left out.
void take_measures(const ComparisonSummary& summary, const CompareOptions& options,
                   std::map<std::string, double>& values);

// Writes what follows from the frames one by one: the percentiles of their worst regions, also over what is covered,
// and how much patches replace.
void take_frame_measures(RdPoint& point);

nlohmann::json to_json(const RdPoint& point);
// Nothing if the JSON was not written by to_json.
std::optional<RdPoint> rd_point_from_json(const nlohmann::json& json);

// ---- The output of the sweep: tables for people, CSV for programs ---------------------------------------------------

// Names of the coders in the order of their first points.
std::vector<std::string> coders_of(std::span<const RdPoint> points);

// One line per coder and quality: rates, bits per vertex by layer, measures, speeds.
std::string rate_table(std::span<const RdPoint> points);

// EP-frames only, bits per vertex by layer; empty if there are none.
std::string enhanced_frame_table(std::span<const RdPoint> points);

// The worst regions of I-frames and of the frames between, and how much of the surface patches replace; empty if there
// are neither worst regions nor patches.
std::string region_table(std::span<const RdPoint> points);

// How much of the captured and of the shown surface is covered, and the errors over it (metrics/coverage.h); empty if
// that was not measured.
std::string coverage_table(std::span<const RdPoint> points);

// The measure at which bits are compared at equal M2: over what is covered where that was measured, else M2.
const Measure& equal_m2_measure(std::span<const RdPoint> points);

// Bjontegaard rate differences of every coder relative to `reference`, for every measure that was taken; empty if the
// reference was not measured.
std::string rate_difference_table(std::span<const RdPoint> points, const std::string& reference);
nlohmann::json rate_differences_json(std::span<const RdPoint> points, const std::string& reference);

// Where the M1 curve of `first` crosses that of `second`, as a sentence; empty if one of them was not measured.
std::string crossing_sentence(std::span<const RdPoint> points, const std::string& first, const std::string& second);

// One line per coder and quality.
std::string rd_csv(std::span<const RdPoint> points);

}  // namespace htvm::lab
