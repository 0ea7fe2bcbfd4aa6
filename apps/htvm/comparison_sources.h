// The two sequences that htvm compare measures: both in the same unit and coordinates, and which frames are pairs.
#pragma once

#include <vector>

#include "comparison_request.h"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"
#include "sequences.h"

namespace htvm::app {

struct Sources {
    MeshSource original, decoded;
};
Result<Sources> open_sources(const ComparisonRequest& options);

// The positions of the frames to compare: of files by time or the numbers in their names, of a stream by time; in order
// where that pairs none, or fewer than there are though both sides have as many.
std::vector<FramePair> pairs_of(const Sources& sources);
void warn_of_frames_left_out(const Sources& sources, const std::vector<FramePair>& pairs);
void warn_of_sizes(const Sources& sources, const Mesh& original, const Mesh& decoded);

// The box around all originals, for cameras that stand still.
Result<Box> sequence_box(const ComparisonRequest& options, const std::vector<FramePair>& pairs);

}  // namespace htvm::app
