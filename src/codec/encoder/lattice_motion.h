// Rigid motions on the lattice: how bones move by the tracked skeleton, and how motion and orientations are quantised.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "codec/reference/skinning.h"
#include "codec/reference/transforms.h"
#include "htvm/skeleton.hpp"
#include "surface/rigid_registration.h"

namespace htvm::internal {

// eq. 4: the motion of each bone from the pose of the reference to that of this frame.
std::vector<RigidMotion> skeletal_motion(const ReferenceMesh& reference, const std::vector<Bone>& bones,
                                         const CodedPose& pose);

QuantisedTransform quantise_motion(const RigidMotion& motion, LatticePoint pivot);
RigidMotion motion_of(const QuantisedTransform& transform, LatticePoint pivot);
QuantisedRotation quantise_orientation(const Rotation& orientation);
Eigen::Matrix3d matrix_of(const QuantisedRotation& rotation);

}  // namespace htvm::internal
