// What a captured surface asks of a moved reference: how far each vertex is to be displaced along its normal, and which
// colour it is to have, for the triangles between the vertices to lie on the surface and look like it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/tracked/tracked_frame.h"
#include "surface/target_surface.h"
#include "core/thread.h"

namespace htvm::internal {

// A reference mesh moved by its nodes.
struct MovedReference {
    std::span<const LatticePoint> positions;
    std::span<const ExactNormal> normals;  // one a vertex
    std::span<const Triangle> triangles;
    std::span<const Colour> colours;  // one a vertex, or none
};

struct TrackedTargets {
    std::vector<std::int32_t> displacement;  // one a vertex, lattice units along its normal
    std::vector<std::int32_t> colours;       // three a vertex, levels to add; empty where the reference has none
};

// captured: the mesh that `surface` was made of. reach: lattice units; what has no surface within it takes after its
// neighbours. Least squares over the whole surface, not at the vertices alone: a coarse reference's vertices lie
// outside a round limb, so that its triangles lie half outside and half inside.
TrackedTargets find_tracked_targets(const MovedReference& moved, const LatticeMesh& captured,
                                    const TargetSurface& surface, double reach, Threads threads);

}  // namespace htvm::internal
