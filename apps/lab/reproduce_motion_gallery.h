// Figure 19: a frame by motion-based coding at rising rates, and its seam before and after zippering.
#pragma once

#include <set>
#include <vector>

#include "reproduce_figures.h"
#include "reproduce_gallery.h"

namespace htvm::lab {

// Figure 19 and, numbered 19b, the zippering, where wanted; findings.seams is filled. zippering.png beside the tiles
// holds those of 19b side by side.
Result<std::vector<Figure>> motion_pictures(const SourceFrames& source, const ExperimentPlan& plan,
                                            const std::set<int>& wanted, const GalleryOptions& options,
                                            Findings& findings);

// What zippering does to open edges, cracks and flaps, frame by frame; nothing without figure 19.
std::optional<Table> seam_table(const Findings& findings);

// The mesh with three vertices a triangle, of one colour: the first coded_triangles, those up to kept_end (animated),
// and the rest (stitches) each have theirs.
Mesh tinted(const Mesh& mesh, std::size_t coded_triangles, std::size_t kept_end);

// The middle and the direction of a stretch of seam: the stitch with most stitches near it. Nothing without stitches.
struct SeamSpot {
    Point3 centre, normal;
};
std::optional<SeamSpot> busiest_seam(const SeamStages& stages, double radius);

}  // namespace htvm::lab
