// The pose of each frame as the codec needs it: on the lattice, complete, with an orientation for every bone.
#pragma once

#include "codec/reference/transforms.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::internal {

struct PoseTracker {
    Skeleton skeleton;
    bool tracked = true;  // false: one bone that spans the first mesh stands in, carried along by each mesh's middle
    Pose rest;            // the first pose: where orientations are not given, they are turned from it
    Pose last;            // kept where a frame has no pose
    Vector3d rest_middle{};

    // bad_input where the pose has another number of joints or orientations than the skeleton, or one not finite.
    Result<CodedPose> next(const Mesh& mesh, const Pose* pose, const Lattice& lattice);
};

// skeleton without bones: none is tracked. bad_input where there is a skeleton but no pose for the first frame.
Result<PoseTracker> make_pose_tracker(const Skeleton& skeleton, const Mesh& first_mesh, const Pose* first_pose);

}  // namespace htvm::internal
