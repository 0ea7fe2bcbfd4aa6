// What htvm compare says of the worst regions: of all frames, of a stream's I-frames and of its others.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "htvm/frame.hpp"
#include "metrics/compare.h"

namespace htvm::app {

// kinds: of each frame, if it is known.
std::string region_rows(const std::vector<FrameComparison>& frames, const std::vector<std::optional<FrameType>>& kinds);
nlohmann::json regions_json(const std::vector<FrameComparison>& frames,
                            const std::vector<std::optional<FrameType>>& kinds);

}  // namespace htvm::app
