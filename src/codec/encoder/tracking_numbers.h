// What was tuned of tracking: every length, share and ratio by which the encoder decides how a surface is tracked, when
// tracking is lost and what is sent then. docs/tracked_frames.md tells what each is for. What belongs to one algorithm
// alone stands beside it: registration in surface/deformable_mesh.h, effort in tracking_effort.h, noise in
// target_filter.cpp.
#pragma once

#include <array>
#include <cstdint>

#include "core/length.h"

namespace htvm::internal {

struct TrackingNumbers {
    // ---- Where a surface is looked for
    AdultMillimetres reach{30};      // how far from a mesh that should lie on the captured surface that is looked for
    AdultMillimetres fit_reach{25};  // the same where it is measured how well the mesh fits: no distance counts as more
    AdultMillimetres slip{30};       // by less than this a tracked mesh slips along the surface unless it is lost
    AdultMillimetres region{100};    // side of the cubes in which it is judged whether a part is lost: a hand's breadth
    AdultMillimetres node_spacing{80};  // largest distance along the mesh from a vertex to its node

    // ---- The reference of T-frames
    double finer = 0.55;           // step of positions and displacements, in steps asked for: the error is then that of
                                   // the other profiles
    double coarser_colours = 1.3;  // step of an I-frame's colours, likewise
    double coarser_tracked_colours = 6;  // step of a T-frame's colours, likewise: re-meshing alone makes the colour at
                                         // one place vary, and finer steps code that noise
    // Where simplification keeps more of the captured vertices than that, levels are not tried: what is left to say is
    // the capture's own triangles (docs/experiments/hierarchy.md).
    double levels_most_kept = 0.62;
    // The same where there are charts: on triangles much coarser than the capture's, pictures take more bits than is
    // saved.
    double levels_most_kept_with_charts = 0.28;
    double levels_step = 0.85;  // step of an I-frame's finest displacements, where it has levels, in steps of positions
    std::uint32_t referred_level = 1;  // the level that T-frames refer to
    double finer_renewed = 0.5;  // step of an I-frame made of the tracked mesh, in steps of one made of the capture:
                                 // what is quantised already would err twice as far, and jump
    AdultMillimetres longest_edge{40};  // of a simplified reference
    double simplified_colours = 2.5;    // how far a simplified vertex's colour may be off, in steps asked for

    // ---- When tracking is lost
    double stray_in_edges = 2;   // a sample is astray that is farther off, in mean edges of the captured mesh
    double more_strays = 0.004;  // lost: by how much more of the samples are astray than of the I-frame's
    double worst_to_best = 2.2;  // lost: RMS distance over that of the best T-frame
    double quantised = 0.75;     // but not below this many steps asked for: on a clean capture the best T-frame may
                                 // be far better than quantisation lets an I-frame be
    AdultMillimetres visible_over_all{0.8};  // nor below this: at fine quality T-frames bring it back
    double region_to_best = 5;        // lost: RMS distance in the worst region over that of the best T-frame's whole
    double region_to_intra = 1.5;     // but not below this many times the I-frame's worst region,
    AdultMillimetres visible{3.5};    // nor below what is seen,
    double remeshed_in_edges = 0.42;  // nor below what re-meshing does to a surface: in mean edges of the captured mesh

    // ---- When the picture falls apart
    AdultMillimetres most_of_all{4};      // RMS distance of the whole: most of the person is lost
    AdultMillimetres most_in_region{30};  // RMS distance in a region: all of a limb is lost
    double apart_to_lost = 3;             // either only from this many times what counts as lost on

    // ---- Patches
    AdultMillimetres lost{6};     // what lies farther off is lost by itself, and what is around it as far as it is half
                                  // as far off; at least `remeshed_in_edges`
    AdultMillimetres speck{20};   // side of a square: lost parts of a smaller area are left alone
    double lost_in_steps = 1.75;  // a region is patched from this error on, in steps asked for, where that is less than
                                  // counts as lost: at fine steps a bit brings more where less is wrong
    double most_patch_bytes = 0.8;  // of the I-frame's: a patch that takes more is not worth it
    int most_patches = 24;          // behind one I-frame: whoever joins late needs all of them
    double most_patches_bytes = 4;  // all together, in times the I-frame's

    // ---- Where surface comes and goes: when what is captured beside the tracked mesh is added to it
    AdultMillimetres far_from_seen{10};  // a vertex farther from captured surface that faces as it does is not shown
    AdultMillimetres filled_hole{90};    // rim of a hole of the first mesh that is closed
    double much_uncovered = 0.03;        // share of the captured surface from which on it is added by the next frame
    AdultMillimetres grown_from{20};     // side of a square as large as what is uncovered in a region, from which on it
    int grown_after = 6;                 // is added, these many frames behind the last patch,
    AdultMillimetres grown_soon{80};     // or by the next frame
    double worn_off = 0.004;      // share of the captured surface that is uncovered all together, from which on it is
    int worn_after = 60;          // added these many frames behind the last patch
    int attempts_where_open = 3;  // SurfacePatchOptions::attempts where surface comes and goes: what does not fit by
                                  // then stays open
    int again_after = 6;          // frames after which that, or looking for limbs, is tried again where it was vain
    int forgotten_after = 150;    // frames for which a vertex was not seen: the next I-frame leaves it out
    double most_grown = 2.5;      // as most_renewed_vertices, where the reference grows with what is seen

    // Bits are worth so much of the error: by this power of it, since a bit that is saved elsewhere brings as much
    // (docs/experiments/hierarchy.md).
    double bits_by_error = 1.6;

    // ---- Where a capture keeps its vertices for a while, then is begun anew: see fresh_reference.h
    double vertices_again = 0.5;                      // share of them that is known again, from which on they are kept
    std::uint32_t least_kept = 8;                     // frames in a row: fewer are not worth an I-frame
    std::array<std::uint32_t, 2> measured_at{4, 12};  // frames behind an I-frame: how far its T-frames are off
    double most_served = 60;    // frames that one is expected to serve: as many as before, but these
    double least_saved = 0.15;  // of the price of these frames, as a logarithm

    // ---- When an I-frame is sent
    double most_others = 0.1;  // share of the vertices that have other texture coordinates: the atlas is laid out anew
    double most_renewed_vertices = 1.3;  // of the tracked mesh, in times those of the last I-frame made of the capture:
                                         // with more, or
    double most_renewed_steps = 1.5;     // at steps that differ by more than this ratio, the capture is coded instead
};

inline constexpr TrackingNumbers tracking_numbers;

// What an encoder is asked for by default, on the default Scale: options that depend on it have these defaults.
struct UsualRequest {
    LatticeUnits geometry_step{45};   // this and the colours' are of default_quality
    double colour_step = 7;           // levels
    double simplify = 0.4;            // see TrackedOptions
    LatticeUnits captured_edge{128};  // mean edge of a captured mesh
};
inline constexpr UsualRequest usual_request;

}  // namespace htvm::internal
