// All metrics of a pair of meshes in one call, and of a sequence, frame by frame with bounded memory: shared by the
// commands that measure.
#pragma once

#include <cstdint>
#include <optional>

#include "core/image.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/cloud_psnr.h"
#include "metrics/coverage.h"
#include "metrics/mesh_measures.h"
#include "metrics/picture_error.h"
#include "metrics/point_error.h"
#include "metrics/region_error.h"
#include "metrics/surface_error.h"
#include "metrics/texcoord_error.h"
#include "metrics/topology.h"

namespace htvm {

struct CompareOptions {
    bool points = true;     // M1, geometry and colour
    bool surface = true;    // M2
    bool regions = true;    // the worst region
    bool coverage = false;  // of open captures: coverage, and the errors over what is covered
    bool texcoords = true;  // if both meshes have them
    bool cloud = true;      // D1 and D2
    bool pictures = true;   // M3 and SSIM; and unlit, where both meshes have colours
    bool topology = true;   // counts
    SurfaceErrorOptions surface_options;
    TopologyMeasureOptions topology_options;
    CoverageOptions coverage_options;
    ViewOptions views;
    RenderOptions render;            // colours and textures are drawn only if both meshes have some
    std::optional<Box> view_box;     // what the cameras look at in every frame; empty: the bounding box of each
                                     // original
    internal::Threads threads = {};  // the number of threads does not change the results (overrides those of
                                     // surface_options and coverage_options)
};

// One frame. Metrics that were not asked for are left zero.
struct FrameComparison {
    std::uint64_t original_vertices = 0, decoded_vertices = 0;  // those that are shown
    std::uint64_t original_triangles = 0, decoded_triangles = 0;
    Box original_box;
    PointError points;
    SurfaceError surface;
    RegionError region;
    FrameCoverage coverage;
    TexcoordError texcoords;
    CloudError cloud;
    PictureErrorSums pictures;        // as CompareOptions::render says
    PictureErrorSums unlit_pictures;  // the same without shading; zero without colours or textures
    Topology original_topology, decoded_topology;
};

// A mesh to compare, and what pictures show of it: the mesh itself, with its texture if it has one, or the textured
// mesh that its vertex colours were made from. All is lent.
struct ComparedMesh {
    const Mesh* mesh;
    ShownMesh shown;
    ComparedMesh(const Mesh& own) : mesh(&own), shown(own) {}
    ComparedMesh(const TexturedMesh& own) : mesh(&own.mesh), shown(own) {}
    ComparedMesh(const Mesh& own, const TexturedMesh& pictured) : mesh(&own), shown(pictured) {}
};

// Fails (bad_input) if a mesh cannot be measured (check_measurable) or an option is out of range, (limit) if memory
// runs out.
Result<FrameComparison> compare_frame(const ComparedMesh& original, const ComparedMesh& decoded,
                                      const CompareOptions& options = {});

// The sums over the frames so far.
struct SequenceComparison {
    std::uint64_t frames = 0;
    std::uint64_t original_vertices = 0, decoded_vertices = 0;
    std::uint64_t original_triangles = 0, decoded_triangles = 0;
    Box original_box;  // around all frames
    PointError points;
    SurfaceErrorSums surface;
    CoverageSums coverage;
    TexcoordError texcoords;
    CloudError cloud;
    PictureErrorSums pictures, unlit_pictures;
    Topology original_topology, decoded_topology;  // sums over the frames
};
SequenceComparison& operator+=(SequenceComparison& sums, const FrameComparison& frame);
SequenceComparison as_sequence(const FrameComparison& frame);  // from one frame

// The numbers shown in tables and curves. PSNR is infinite if there is no difference.
struct ComparisonSummary {
    double m1_mm = 0, m1_forward_mm = 0, m1_backward_mm = 0, m1_largest_mm = 0;
    bool has_colour = false;                                              // whether both sequences have colours in some
                                                                          // frame
    double m1_colour = 0, m1_colour_forward = 0, m1_colour_backward = 0;  // levels
    double m2_mm = 0, m2_worst_frame_mm = 0;
    SurfaceDistances m2_forward, m2_backward;
    // Coverage, 0..1, of the captured and of the shown surface; the least of a frame; and the errors over what is
    // covered, if anything was in some frame.
    double captured_covered = 1, captured_absent = 0, captured_least_covered = 1;
    double shown_covered = 1, shown_absent = 0, shown_least_covered = 1;
    bool has_covered = false;
    double covered_m2_mm = 0, covered_worst_frame_mm = 0;
    SurfaceDistances covered_forward, covered_backward;
    bool has_texcoords = false;                       // likewise
    double texcoord_rms = 0, texcoord_elsewhere = 0;  // see texcoord_error.h; 0..1
    double hausdorff_mm = 0;                          // the largest distance in both directions and all frames
    double peak_mm = 0;                               // for D1 and D2
    double d1_db = 0, d2_db = 0;
    double m3_foreground_db = 0, m3_full_db = 0, m3_ssim = 1;
    double foreground_share = 0;  // of the pixels
    bool has_unlit = false;       // whether both meshes had colours in some frame; the pictures of the others show none
    double m3_unlit_foreground_db = 0, m3_unlit_full_db = 0, m3_unlit_ssim = 1;
};

// peak_mm: for D1 and D2; 0: the diagonal of the box around all originals so far.
ComparisonSummary summarise(const SequenceComparison& sums, double peak_mm = 0);

}  // namespace htvm
