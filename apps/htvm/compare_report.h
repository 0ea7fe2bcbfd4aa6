// What a comparison says: as a table for people, as JSON and as lines of CSV for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "metrics/compare.h"

namespace htvm::app {

// A table of all that `options` asked for.
std::string comparison_table(const SequenceComparison& sums, const CompareOptions& options, double peak_mm);

// Only what `options` asked for. A PSNR without any difference, an infinite one, is null.
nlohmann::json summary_json(const ComparisonSummary& summary, const CompareOptions& options);
nlohmann::json topology_json(const Topology& topology);

// One line a frame, the columns that `options` asked for; infinity is inf.
std::string csv_header(const CompareOptions& options);
std::string csv_line(std::size_t frame, const FrameComparison& comparison, const CompareOptions& options,
                     double peak_mm);

const char* shading_name(Shading shading);

}  // namespace htvm::app
