// Motion-coded frames taken apart: what was coded, what is animated, and the seam that zippering closes (figure 19).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/encoder.hpp"
#include "metrics/topology.h"
#include "rd_source.h"

namespace htvm::lab {

// A frame before, during and after zippering, mm. The coded part comes first in each mesh but `animated`, its vertices
// and triangles.
struct SeamStages {
    std::size_t frame = 0;
    std::size_t coded_triangles = 0;
    std::size_t kept_end = 0;  // in trimmed and zippered: behind it come the stitches
    Mesh animated;             // the I-frame's whole mesh moved, as a P-frame would show it
    Mesh overlapping;          // with every animated triangle that has a vertex of a still bone
    Mesh trimmed;              // with the animated triangles that stay
    Mesh zippered;             // with the stitches: what the decoder shows
};

// Codes the first frame as an I-frame and the others against it, by rising time; gives those that came out partly
// coded. The skeleton and radii are the facts'.
Result<std::vector<SeamStages>> code_in_stages(const std::vector<std::shared_ptr<const SourceFrame>>& frames,
                                               const SequenceFacts& facts, const EncoderOptions& options);

// What topology() finds in a frame as captured and at each stage.
struct SeamCounts {
    std::size_t frame = 0;
    Topology original, animated, overlapping, trimmed, zippered;
};
// A crack may be as wide as two edges of the captured mesh are long, so that wide ones are found too.
Result<SeamCounts> count_seams(const Mesh& original, const SeamStages& stages, unsigned threads);

}  // namespace htvm::lab
