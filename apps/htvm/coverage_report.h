// What htvm compare says where surfaces come and go: coverage, the errors over what is covered, what appears and
// vanishes from frame to frame, and how near the truth is.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "metrics/compare.h"
#include "metrics/presence_change.h"
#include "metrics/truth_coverage.h"
#include "region_report.h"

namespace htvm::app {

// One for each frame. A change is missing in the first frame and behind a gap; truths are empty if it is not known.
struct CoverageFrames {
    std::vector<std::optional<PresenceChange>> changes;
    std::vector<TruthCoverage> truths;
    WorstRegions regions;  // over what is covered
};
// The regions follow from the comparison; the rest is added by who measures it.
void add_region(CoverageFrames& frames, const FrameCoverage& coverage, std::optional<FrameType> kind);

std::string coverage_rows(const ComparisonSummary& s, const CompareOptions& options, const CoverageFrames& frames);
nlohmann::json coverage_json(const ComparisonSummary& s, const CompareOptions& options, const CoverageFrames& frames);
nlohmann::json coverage_json(const FrameCoverage& coverage, const CoverageFrames& frames, std::size_t frame);

// Cells of a line of CSV, and their names.
std::string coverage_names(const CoverageFrames& frames);
std::string coverage_cells(const FrameCoverage& coverage, const CoverageFrames& frames, std::size_t frame);

}  // namespace htvm::app
