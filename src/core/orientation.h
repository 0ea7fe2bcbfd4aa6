// Bone orientations from joint positions, for trackers that report positions alone (T^i of the paper, section IV-B).
// Positions say where a bone points, but not how it is twisted about its own axis; the functions here differ in where
// the twist comes from. All use + - x / and square roots only.
#pragma once

#include <vector>

#include "htvm/skeleton.hpp"

namespace htvm::internal {

inline constexpr Rotation identity_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};

// a b: the rotation that applies b first, then a.
Rotation multiply(const Rotation& a, const Rotation& b);

// The rotation applied to a vector.
Vector3d rotate(const Rotation& rotation, const Vector3d& v);

// The nearest exact rotation: orthonormal (Gram-Schmidt) and right-handed, its rows kept as far as possible. Rows that
// are zero, parallel or not finite give the identity.
Rotation orthonormalised(const Rotation& rotation);

// The rotation by the smallest angle that takes direction `from` to direction `to` (any lengths). Opposite directions
// turn by 180 degrees about `hint` made perpendicular to `from`, or about any perpendicular axis if the hint is
// parallel to it. A zero or non-finite vector gives the identity.
Rotation minimal_rotation(const Vector3d& from, const Vector3d& to, const Vector3d& hint = {0, 1, 0});

// The orientation of the bone from joint `first` to joint `second` (mm): its first axis (the first column of the
// matrix) lies along the bone. The other two axes follow by parallel transport, that is without twist, from `previous`
// if given, else from the identity, whose bone lies along +x. A bone of zero length keeps the previous orientation, or
// the identity.
Rotation bone_orientation(const Vector3d& first, const Vector3d& second, const Rotation* previous);

// One orientation per bone of the skeleton, from the joints of the pose. Without a reference: bone_orientation of each
// bone. With one: the minimal rotation that takes the bone's direction in the reference to that in this pose, times the
// reference's orientation (given, or else from bone_orientation). A bone of zero length in this pose keeps the
// reference's orientation. Bones whose joints the pose lacks get the identity.
std::vector<Rotation> derive_orientations(const Skeleton& skeleton, const Pose& pose, const Pose* reference);

// Like derive_orientations with a reference, except that a body that turns as a whole turns all its bones, including
// the upright ones, which minimal rotations alone would leave as they were. First the reference is turned as one rigid
// body onto this pose (least squares over all joints). Then each bone gets the minimal rotation onto its direction, and
// a twist about its own axis that brings the joints around it as close as possible (joints nearer along the skeleton
// weigh more). If all joints lie in one line there is no twist. Falls back to derive_orientations if joints are
// missing.
std::vector<Rotation> derive_turning_orientations(const Skeleton& skeleton, const Pose& pose, const Pose& reference);

}  // namespace htvm::internal
