// What htvm compare says of the metrics of compare_frame: a table for people, JSON and CSV for programs.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "metrics/compare.h"

namespace htvm::app {

// A row of the table: both directions and the larger; or a single number.
std::string row(const std::string& what, double forward, double backward, double larger, int digits);
std::string single(const std::string& what, double value, int digits);

// A table of everything that `options` asked for.
std::string comparison_table(const SequenceComparison& sums, const CompareOptions& options, double peak_mm);

nlohmann::json distances_json(const SurfaceDistances& d);
nlohmann::json topology_json(const Topology& t);
// Only what `options` asked for. An infinite PSNR, without any difference, becomes null.
nlohmann::json summary_json(const ComparisonSummary& s, const CompareOptions& options);

// One line per frame, without its end, with the columns that `options` asked for; infinity is written as inf.
std::string csv_header(const CompareOptions& options);
std::string csv_line(std::size_t frame, const FrameComparison& comparison, const CompareOptions& options,
                     double peak_mm);

}  // namespace htvm::app
