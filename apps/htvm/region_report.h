// What htvm compare says of the worst regions: of all frames, of a stream's I-frames and of its others.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "htvm/frame.hpp"

namespace htvm::app {

// One for each frame: the RMS distance in its worst region, not a number in a frame that has none; its kind, if it is
// known. title: of the table's rows.
struct WorstRegions {
    std::vector<double> worst_mm;
    std::vector<std::optional<FrameType>> kinds;
};
std::string region_rows(const char* title, const WorstRegions& frames);
nlohmann::json regions_json(const WorstRegions& frames);

}  // namespace htvm::app
