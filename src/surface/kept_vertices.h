// How the vertices of a capture that keeps them move a reference. Captures that somebody has tracked already have the
// same triangles for many frames, so each vertex says where its piece of surface has gone, however far. Encoder only: a
// registration begins there, and what is nearer to the surface is kept.
#pragma once

#include <span>
#include <vector>

#include "core/length.h"
#include "core/thread.h"
#include "surface/deformable_mesh.h"
#include "surface/rigid_registration.h"
#include "surface/surface_index.h"

namespace htvm::internal {

struct KeptVerticesOptions {
    Scale scale;                 // of the lattice on which the positions are
    AdultMillimetres reach{60};  // how far a sample of the reference may be from the vertex that it goes with
    float agreement = 0.5F;      // least dot product of their normals
    std::size_t fewest = 6;      // vertices that say how a handle moves; one with fewer follows all vertices together
    Threads threads = {};
};

// A capture's positions in two frames whose triangles are the same.
struct KeptVertices {
    std::span<const Point3f> before, now;
    std::span<const Triangle> triangles;
};

// The motions reference -> frame, one per handle: each as at `last` (one per handle, or none: at rest), carried on by
// the vertices beside its samples. None if there are no vertices beside the reference. The result is the same for any
// number of threads.
std::vector<RigidMotion> carried_by_vertices(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                             const KeptVertices& vertices, const KeptVerticesOptions& options);

}  // namespace htvm::internal
