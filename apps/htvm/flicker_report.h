// What htvm compare says of flicker: of all frames, of a stream by kind of frame, and of one frame.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "htvm/frame.hpp"
#include "metrics/flicker.h"

namespace htvm::app {

// A frame's change of the pictures since the frame before, which a frame of files or behind a gap may not have; and its
// kind, if it is known.
struct FlickerFrame {
    std::optional<FrameFlicker> change;
    std::optional<FrameType> kind;
};

bool has_flicker(const std::vector<FlickerFrame>& frames);

// Rows of the table; shading_of_lit: that of FrameFlicker::lit.
std::string flicker_rows(const std::vector<FlickerFrame>& frames, Shading shading_of_lit);
// Cells of a line of CSV: kind, then ratio and change at still pixels, lit and unlit.
std::string flicker_cells(const FlickerFrame& frame);
nlohmann::json flicker_json(const FrameFlicker& flicker);
nlohmann::json flicker_json(const std::vector<FlickerFrame>& frames);

}  // namespace htvm::app
