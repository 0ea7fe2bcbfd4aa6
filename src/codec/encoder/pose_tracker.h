// The pose of each frame in the form that the codec needs: on the lattice, complete, with an orientation for every
// bone.
#pragma once

#include "codec/reference/transforms.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::internal {

struct PoseTracker {
    Skeleton skeleton;
    bool has_skeleton = true;  // false: one bone that spans the first mesh stands in, and moves with each mesh's centre
    Pose rest;                 // the first pose, from which orientations are derived where they are not given
    Pose last;                 // repeated for a frame without a pose
    Vector3d rest_middle{};

    // bad_input if the number of joints or orientations differs from the skeleton's, or a value is not finite.
    Result<CodedPose> next(const Mesh& mesh, const Pose* pose, const Lattice& lattice);
};

// A skeleton without bones means that none is tracked. bad_input if there is a skeleton but no pose for the first
// frame.
Result<PoseTracker> make_pose_tracker(const Skeleton& skeleton, const Mesh& first_mesh, const Pose* first_pose);

}  // namespace htvm::internal
