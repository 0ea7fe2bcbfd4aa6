// What the encoder asks a captured surface for a tracked frame: the few vertices that stand for it as a reference, what
// it wants of a reference that was moved to it, and whether the decoded frame still stands for it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/tracked/tracked_frame.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "surface/surface_index.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

// The captured mesh, ready to be registered to.
SurfaceIndex captured_surface(const LatticeMesh& mesh, const DeformationOptions& options);

// A reference mesh moved by its nodes.
struct MovedReference {
    std::span<const LatticePoint> positions;
    std::span<const Vector3d> normals;  // one per vertex
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;  // one per vertex, or none
};

struct TrackedTargets {
    std::vector<std::int32_t> displacement;  // one per vertex, lattice units along its normal
    std::vector<std::int32_t> colours;       // three per vertex, levels to add; empty where the reference has none
};

// captured: the mesh that `surface` was made of. reach: lattice units; what has no surface within it takes after its
// neighbours. Least squares over the whole surface, not at the vertices alone: a coarse reference's vertices lie
// outside a round limb, so that its triangles lie half outside and half inside.
TrackedTargets find_tracked_targets(const MovedReference& moved, const LatticeMesh& captured,
                                    const SurfaceIndex& surface, double reach, Threads threads);

// From a few thousand samples each way, the worse direction of the two; lattice units.
struct TrackedFit {
    double rms = 0;               // distance from surface to surface; none counts as more than `reach`
    double stray_share = 0;       // of the samples that are farther than `stray`
    double worst_region = 0;      // the root mean square in the worst cube of space
    std::vector<double> squared;  // distances of the decoded mesh's samples from the captured surface
};

struct TrackedFitOptions {
    double stray = 200;    // lattice units, > 0
    double reach = 400;    // likewise: on the captured surface nothing is looked for farther away
    double region = 1600;  // side of the cubes, likewise; those with few samples are left out
    Threads threads = {};
};

// captured: of the captured mesh. intra_squared: `squared` of the I-frame, whose connectivity `decoded` has; what its
// samples were off there is not held against the frame, since the search does not find every long triangle of a sole,
// nor are those of the I-frame itself, for which it is empty.
TrackedFit measure_tracked_fit(const SurfaceIndex& captured, const LatticeMesh& decoded,
                               std::span<const double> intra_squared, const TrackedFitOptions& options);

struct SimplifiedReferenceOptions {
    double surface_error = 16;  // lattice units, > 0: see SimplificationOptions
    double colour_error = 16;   // levels, > 0
    double longest_edge = 640;  // lattice units, > 0
    double reach = 480;         // lattice units: how far the captured surface is looked for
    Threads threads = {};
};

// Normals are made anew where the capture has them. Texture coordinates cannot be simplified: a mesh that has some, or
// has no triangles, comes back as it is.
// surface: of `captured`.
LatticeMesh simplified_reference(const LatticeMesh& captured, const SurfaceIndex& surface,
                                 const SimplifiedReferenceOptions& options);

}  // namespace htvm::internal
