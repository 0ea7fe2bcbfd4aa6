// Bone orientations from joint positions, for trackers that give positions alone (T^i of the paper, section IV-B).
// Positions say where a bone points, not how it is twisted about itself: the functions here differ in where the
// twist comes from. All use + - x / and square roots only.
#pragma once

#include <vector>

#include "htvm/skeleton.hpp"

namespace htvm::internal {

inline constexpr Rotation identity_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};

// a b: the rotation that applies b first, then a.
Rotation multiply(const Rotation& a, const Rotation& b);

// The rotation applied to a vector.
Vector3d rotate(const Rotation& rotation, const Vector3d& v);

// The nearby exact rotation: rows kept as far as possible, made orthonormal (Gram-Schmidt) and right-handed.
// Rows that are zero, parallel or not finite give the identity.
Rotation orthonormalised(const Rotation& rotation);

// The rotation by the smallest angle that takes direction `from` to direction `to` (any lengths). Opposite
// directions turn half round about `hint` made perpendicular to `from`, or about some perpendicular axis where the
// hint is parallel to it; a zero or non-finite vector gives the identity.
Rotation minimal_rotation(const Vector3d& from, const Vector3d& to, const Vector3d& hint = {0, 1, 0});

// The orientation of the bone from joint `first` to joint `second` (mm): its first axis (the matrix's first column)
// lies along the bone. Where `previous` is given, the other two follow by parallel transport of it: no twist from
// it to the result; else by parallel transport of the identity, whose bone lies along +x. A bone of zero length
// keeps the previous orientation, or the identity.
Rotation bone_orientation(const Vector3d& first, const Vector3d& second, const Rotation* previous);

// One orientation per bone of the skeleton, from the joints of the pose. Without a reference: bone_orientation of
// each bone. With one: the minimal rotation that takes the reference's bone direction to this pose's, times the
// reference's orientation (its own where it has orientations, else bone_orientation). A bone of zero length in this
// pose keeps the reference's orientation. Bones whose joints the pose lacks get the identity.
std::vector<Rotation> derive_orientations(const Skeleton& skeleton, const Pose& pose, const Pose* reference);

// As derive_orientations with a reference, but a body that turns as a whole turns all its bones, also the upright
// ones, which minimal rotations alone leave where they were: the reference is first turned as one rigid body onto this
// pose (least squares over all joints), then each bone by the minimal rotation onto its direction, then about itself
// so that the joints around it (nearer along the skeleton: more weight) come as close as they can, as far as they tell.
// Joints all in one line give the minimal rotation alone. Falls back to derive_orientations where joints are missing.
std::vector<Rotation> derive_turning_orientations(const Skeleton& skeleton, const Pose& pose, const Pose& reference);

}  // namespace htvm::internal
