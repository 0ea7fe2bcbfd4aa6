// A capture and what is shown of it against the truth, which only synthetic captures have: the whole surface, of which
// the cameras saw a part (htvm synth). Against the capture itself, nothing can be better than the capture: holes that
// are filled with what other frames saw count as too much there, and noise that is left out as an error.
#pragma once

#include <cstdint>
#include <span>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/coverage.h"

namespace htvm {

// Areas in mm^2, of the truth; they add up over frames, and so do the squares.
struct TruthCoverage {
    std::uint64_t captured_samples = 0, shown_samples = 0;
    double captured_squared = 0;  // mm^2: distances of all places of the captured surface to the truth
    double shown_squared = 0;     // and of the shown surface, of the places whose nearest on the truth is seen
    double area = 0;
    double captured = 0, shown = 0;  // covered by either
    double filled = 0;               // covered by what is shown, but not by the capture: its holes, mended
    double lost = 0;                 // covered by the capture, but not by what is shown
};
TruthCoverage& operator+=(TruthCoverage& sums, const TruthCoverage& frame);

// seen: for each vertex of the truth whether a camera sees it in this frame (a triangle is seen if its three are);
// empty: the truth is seen where the capture covers it. All three meshes must be measurable. Errors: bad_input if
// `seen` is neither empty nor of the truth's vertices or the truth has no triangles, limit if memory runs out.
Result<TruthCoverage> truth_coverage(const Mesh& captured, const Mesh& shown, const Mesh& truth,
                                     std::span<const std::uint8_t> seen = {}, const CoverageOptions& options = {});

double captured_to_truth_rms(const TruthCoverage& sums);  // mm; 0 without a sample
double shown_to_truth_rms(const TruthCoverage& sums);
double truth_share(const TruthCoverage& sums, double TruthCoverage::*area);  // 0..1, of the truth's area

}  // namespace htvm
