// Registers a reference mesh that is deformed by handles to the surface of another mesh: Gauss-Newton steps on the
// distances of closest points, where neighbouring handles move as rigidly as the data allow (Sumner, Schmid, Pauly
// 2007; Li, Sumner, Pauly: Global correspondence optimization for non-rigid registration of depth scans, 2008). Encoder
// only: the result is quantised before it is used to predict.
//
// Positions are in lattice units, as are lengths that are no more than numbers; options are in millimetres on an adult
// and say how long one is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "surface/deformable_mesh.h"
#include "surface/rigid_registration.h"
#include "surface/surface_index.h"

namespace htvm::internal {

// What the data say about the motions that were found: the squared distances of the matches, each with its weight, grow
// by x' F x if the handles move by x, of each a turn in radians about its moved place, then a shift. Along the
// surface F is next to nothing, as the data leave the motion open there. Its blocks below the diagonal are the
// transposes of those above.
struct DeformationForm {
    struct Block {
        std::uint16_t row = 0, column = 0;  // row < column
        Matrix6 matrix;
    };
    std::vector<Matrix6> diagonal;  // one per handle; none if nothing could be registered
    std::vector<Block> above;       // ascending by row, then column
    double weight = 0;              // of all matches together
    // For each vertex, the vertex of the target that the sample nearest to it was matched to last, or
    // OrientedPoints::no_point.
    std::vector<std::uint32_t> matches;
};

// The motions reference -> frame, one per handle, that align the reference with the target. Begins at `start` (one per
// handle, or empty: no motion). form, if not null, is set to that of the last fine round. known: what another start has
// led to, one per handle, or empty: once coarse rounds take no limb elsewhere, that is the result. The result is the
// same for any number of threads.
std::vector<RigidMotion> register_deformation(const DeformableMesh& mesh, const SurfaceIndex& target,
                                              std::span<const RigidMotion> start, const DeformationOptions& options,
                                              DeformationForm* form = nullptr, std::span<const RigidMotion> known = {});

// A start for the next frame: each handle repeats its step from `before` to `last`. One motion per handle in each.
std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last);

// The same for another mesh, which is the deformed one as it was at `last`, or most of it: each of its handles repeats
// the step that the nearest handle of `mesh` made. handles: their positions in the deformed mesh.
std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last, std::span<const Eigen::Vector3d> handles);

// Parts of the reference that `other`, another registration to the same target, takes elsewhere follow it where they
// lie nearer to the target then, by deformation_error(); the whole is settled once more. Gives whether any did.
// motions: one per handle. form: as above, if any did.
bool follow_nearer_limbs(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> other,
                         const DeformationOptions& options, std::vector<RigidMotion>& motions,
                         DeformationForm* form = nullptr);

// Mean distance of the samples to the target's planes and of the target's samples to the reference, each limited to
// near_reach; by this the encoder chooses between starts.
double deformation_error(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> motions,
                         const DeformationOptions& options);

// The deformed reference as floats, for the encoder's own estimates. What is coded is moved in integers.
std::vector<Point3f> deform(const DeformableMesh& mesh, std::span<const RigidMotion> motions, Threads threads);

}  // namespace htvm::internal
