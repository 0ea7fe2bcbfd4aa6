// What the encoder derives from a captured surface for a tracked frame: a simplified mesh to serve as the reference,
// the targets for a reference that was moved to the surface, and whether the decoded frame still fits the surface.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "codec/encoder/tracking_numbers.h"
#include "codec/intra/duplicates.h"
#include "codec/reference/surface_detail.h"
#include "codec/tracked/tracked_frame.h"
#include "core/lattice.h"
#include "core/length.h"
#include "core/thread.h"
#include "surface/surface_index.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

// The captured mesh, prepared for registration to it.
SurfaceIndex captured_surface(const LatticeMesh& mesh, const DeformationOptions& options);

// How many levels of a reference's detail are registered and looked for beside its own vertices: as few as make it four
// times as many or more, or all.
std::size_t levels_to_sample(const SurfaceDetail& detail, std::size_t vertices);

// A reference mesh moved by its nodes.
struct MovedReference {
    std::span<const LatticePoint> positions;
    std::span<const Vector3d> normals;  // one per vertex
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;        // one per vertex, or none
    const SurfaceDetail* detail = nullptr;  // with which it is shown; null, or empty: none
};

struct TrackedTargets {
    std::vector<std::uint32_t> near;  // of each vertex, the captured vertex beside it, or OrientedPoints::no_point
    // Says of each vertex whether it lies beside captured surface, not beyond a border of it: 1, or 2 if that is too
    // far off for it to be shown; none where the surface's borders are not known.
    std::vector<std::uint8_t> seen;
    std::vector<std::int32_t> displacement;  // one per vertex, in lattice units along its normal
    std::vector<std::int32_t> colours;       // three per vertex, levels to add; empty if the reference has no colours
};

// From where in each flat triangle the surface is looked for, beside the vertices.
enum class TargetSamples : std::uint8_t { middles, three };

struct TargetSearch {
    // Vertices without a surface within it take the values of their neighbours.
    LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.reach);
    LatticeUnits far = Scale{}.on_lattice(tracking_numbers.far_from_seen);  // TrackedTargets::seen
    TargetSamples samples = TargetSamples::middles;
    Threads threads = {};
};

// captured: the mesh that `surface` was made from. near: of each vertex a captured vertex that may be beside it, or
// OrientedPoints::no_point; or nothing. The fit is least squares over the whole surface, not only at the
// vertices: on a round limb, the vertices of a coarse reference must lie outside, so that its triangles lie half
// outside and half inside.
TrackedTargets find_tracked_targets(const MovedReference& moved, const LatticeMesh& captured,
                                    const SurfaceIndex& surface, const TargetSearch& how,
                                    std::vector<std::uint32_t> near = {});

// The RMS distance of samples of a surface from another one, in each cube of space.
struct CubeErrors {
    using Cube = std::array<std::int32_t, 3>;
    LatticeUnits side{1};
    std::vector<std::pair<Cube, double>> rms{};  // ascending by cube; cubes with few samples are left out
    double worst() const;
    double at(const Point3f& point) const;  // 0 if its cube is left out
};
// squared: the samples' squared distances. left_out: how many of the farthest of each cube do not count; fewest: of
// samples that a cube must have, > left_out.
CubeErrors cube_errors(std::span<const Point3f> samples, std::span<const double> squared, LatticeUnits side,
                       std::ptrdiff_t fewest, std::ptrdiff_t left_out = 0);

// Measured with a few thousand samples in each direction; the worse of the two directions.
struct TrackedFit {
    LatticeUnits rms;             // RMS distance from surface to surface; no distance counts as more than `reach`
    double stray_share = 0;       // share of the samples that are as far as `stray`
    LatticeUnits worst_region;    // the RMS distance in the worst cube of space
    std::vector<double> squared;  // squared distances of the decoded mesh's samples from the captured surface
    // Where surface comes and goes, what nothing is tracked beside counts as uncovered, not as far off:
    double uncovered_share = 0;     // of the captured samples
    LatticeUnits widest_uncovered;  // side of a square as large as what is uncovered in one cube
};

struct TrackedFitOptions {
    // What is as far off is astray; > 0.
    LatticeUnits stray = tracking_numbers.stray_in_edges * usual_request.captured_edge;
    // Beyond it the captured surface is not searched; > 0.
    LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.fit_reach);
    // Side of the cubes, > 0; cubes with few samples are left out.
    LatticeUnits region = Scale{}.on_lattice(tracking_numbers.region);
    std::span<const std::uint8_t> seen = {};  // of each decoded vertex whether it counts; none: all do
    Threads threads = {};
};

// captured: index of the captured mesh. near: TrackedTargets::near of the frame's targets, or nothing. intra_squared:
// `squared` of the I-frame whose connectivity `decoded` has, or empty for the I-frame itself. Errors that the I-frame
// had at a sample do not count against the frame, since the search misses some long triangles, as those of a sole.
// Where the borders of the captured surface are known, what lies at one does not count, nor what lies beyond one of the
// decoded mesh.
TrackedFit measure_tracked_fit(const SurfaceIndex& captured, const LatticeMesh& decoded,
                               std::span<const std::uint32_t> near, std::span<const double> intra_squared,
                               const TrackedFitOptions& options);

// The least of a reference's fit and that of the one it follows, which frames may not exceed: what tracking leaves must
// not become the measure of what may be left.
TrackedFit least_of(TrackedFit fit, const TrackedFit& before);

struct SimplifiedReferenceOptions {
    // > 0: see SimplificationOptions
    LatticeUnits surface_error = usual_request.simplify * usual_request.geometry_step;
    double colour_error = tracking_numbers.simplified_colours * usual_request.colour_step;  // levels, > 0
    LatticeUnits longest_edge = Scale{}.on_lattice(tracking_numbers.longest_edge);          // > 0
    LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.reach);  // how far to search for the captured surface
    LatticeUnits filled_holes;  // rim of the longest hole that is closed; 0: none is
    LatticeUnits specks;        // side of a square: parts of the surface that are smaller are left out; 0: none is
    Threads threads = {};
};

// Normals are recomputed if the capture has them. Texture coordinates cannot be simplified: a mesh with texture
// coordinates, or without triangles, is returned unchanged. surface: index of `captured`.
LatticeMesh simplified_reference(const LatticeMesh& captured, const SurfaceIndex& surface,
                                 const SimplifiedReferenceOptions& options);
// The same for a piece cut from the captured surface; without normals.
LatticeMesh simplified_piece(const LatticeMesh& piece, const LatticeMesh& captured, const SurfaceIndex& surface,
                             const SimplifiedReferenceOptions& options);

}  // namespace htvm::internal
