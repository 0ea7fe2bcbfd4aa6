// How the vertices of a capture that keeps them move a reference. Captures that somebody has tracked already have the
// same triangles for many frames, so each vertex says where its piece of surface has gone, however far. Where a program
// between has numbered vertices anew, or left out a few triangles that coordinates of few bits had closed, connectivity
// still tells most of them: each vertex is known by that around it (colour refinement: Weisfeiler, Leman, 1968).
// Encoder only: a registration begins there, and what is nearer to the surface is kept.
#pragma once

#include <cstdint>
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

// Each vertex's connectivity up to two edges away as a number, which does not depend on how vertices and triangles are
// numbered. Of a scanned person's vertices 99 in 100 have one that no other has; on a grid of another frame 4 in 100
// are found again, by chance.
std::vector<std::uint64_t> connectivity_around(std::size_t vertices, std::span<const Triangle> triangles);

// For each vertex of a mesh the one of another mesh that alone has the same connectivity_around(), if it is the only
// one in its own mesh too; OrientedPoints::no_point for the others. Where all are equal in their order, each is itself.
std::vector<std::uint32_t> vertices_again(std::span<const std::uint64_t> before, std::span<const std::uint64_t> now);

// A capture's positions in two frames, and vertices_again().
struct KeptVertices {
    std::span<const Point3f> before, now;
    std::span<const Triangle> triangles;  // of the frame before
    std::span<const std::uint32_t> again;
};

// The motions reference -> frame, one per handle: each as at `last` (one per handle, or none: at rest), carried on by
// the vertices beside its samples. None if there are no vertices beside the reference. The result is the same for any
// number of threads.
std::vector<RigidMotion> carried_by_vertices(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                             const KeptVertices& vertices, const KeptVerticesOptions& options);

}  // namespace htvm::internal
