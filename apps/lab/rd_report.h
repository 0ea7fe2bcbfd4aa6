// What the sweep says to people and programs: tables, and lines of CSV.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "rd_result.h"

namespace htvm::lab {

// Names of the coders in the order of their first points.
std::vector<std::string> coders_of(std::span<const RdPoint> points);

// A line a coder and quality: rates, bits per vertex by layer, measures, speeds.
std::string rate_table(std::span<const RdPoint> points);

// EP-frames alone, bits per vertex by layer; empty where there is none.
std::string enhanced_frame_table(std::span<const RdPoint> points);

// Bjontegaard rate differences of every coder against `reference`, in every measure that was taken; empty where the
// reference was not measured.
std::string rate_difference_table(std::span<const RdPoint> points, const std::string& reference);
nlohmann::json rate_differences_json(std::span<const RdPoint> points, const std::string& reference);

// Where the M1 curve of `first` crosses that of `second`, as a sentence; empty where one of them was not measured.
std::string crossing_sentence(std::span<const RdPoint> points, const std::string& first, const std::string& second);

// A line a coder and quality.
std::string rd_csv(std::span<const RdPoint> points);

}  // namespace htvm::lab
