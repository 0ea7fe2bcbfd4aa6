// All pairs of frames, measured one after another.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "comparison_request.h"
#include "comparison_sources.h"
#include "coverage_report.h"
#include "flicker_report.h"
#include "htvm/frame.hpp"
#include "htvm/result.hpp"
#include "metrics/compare.h"
#include "metrics/drift.h"

namespace htvm::app {

struct Measured {
    SequenceComparison sums;
    DriftMeter drift;                // if the truth is given
    std::vector<FrameDrift> drifts;  // of each frame, likewise
    std::vector<FrameComparison> frames;
    std::vector<FlickerFrame> flickers;           // of each frame, if it is asked for
    CoverageFrames coverage;                      // likewise
    std::vector<std::size_t> places;              // the position of each among the originals
    std::vector<std::optional<FrameType>> kinds;  // of each, if it is known
};

// Completes the request: whether coverage is measured, where that depends on the capture, by its first frame.
Result<Measured> measure(ComparisonRequest& options, Sources& sources, const std::vector<FramePair>& pairs);

}  // namespace htvm::app
