// Per-bone motion of an EP-frame against its reference: skeletal prediction (paper, eq. 4), refined by registration of
// the bone's sub-meshes (eq. 5). Encoder side: what comes out is quantised before it predicts anything.
#pragma once

#include <span>
#include <vector>

#include "codec/reference/skinning.h"
#include "codec/reference/transforms.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/rigid_registration.h"

namespace htvm::internal {

// The reference's sub-meshes, ready for nearest-neighbour search; built once per I-frame. Lattice units.
struct ReferenceSearch {
    std::vector<NearestPoints> sub_mesh;                // one per bone
    std::vector<std::vector<Eigen::Vector3f>> normals;  // of the sub-mesh's vertices, from the triangles around them
};
ReferenceSearch make_reference_search(const ReferenceMesh& reference);

// eq. 4: the motion of each bone from the reference's pose to this frame's.
std::vector<RigidMotion> skeletal_motion(const ReferenceMesh& reference, const std::vector<Bone>& bones,
                                         const CodedPose& pose);

// eq. 5: starts each bone from the better of its skeletal motion and its motion in the frame before (empty at first),
// and registers the reference's sub-mesh to the frame's. frame_sub_meshes: the frame's own vertices by bone.
std::vector<RigidMotion> register_bones(const ReferenceSearch& reference, std::span<const LatticePoint> frame,
                                        const SubMeshes& frame_sub_meshes, std::span<const RigidMotion> skeletal,
                                        std::span<const RigidMotion> before, const RegistrationOptions& options,
                                        Threads threads);

QuantisedTransform quantise_motion(const RigidMotion& motion, LatticePoint pivot);
RigidMotion motion_of(const QuantisedTransform& transform, LatticePoint pivot);
QuantisedRotation quantise_orientation(const Rotation& orientation);
Eigen::Matrix3d matrix_of(const QuantisedRotation& rotation);

// How a frame moved against its reference: what P- and EP-frames of it have in common.
struct FrameMotion {
    std::vector<BoneIndex> bone_of_vertex;       // of the captured mesh
    std::vector<RigidMotion> motion;             // of each bone, as registered; the next frame's may start from it
    std::vector<QuantisedTransform> transforms;  // the same as it is sent
    std::vector<LatticePoint> predicted;         // M_P
};

// What a frame's motion is found against.
struct MotionReference {
    const ReferenceMesh* reference = nullptr;
    const ReferenceSearch* search = nullptr;
    const std::vector<Bone>* bones = nullptr;
    std::span<const std::int32_t> radii;  // lattice units
    std::span<const RigidMotion> before;  // of the frame before; empty behind an I-frame
};

// Skinning of the frame, registration of its bones, quantisation, prediction (paper, section IV-A and IV-B).
FrameMotion find_frame_motion(std::span<const LatticePoint> positions, const CodedPose& pose,
                              const MotionReference& against, const RegistrationOptions& options, Threads threads,
                              std::vector<StageTime>& stages);

// "Per-bone motion" (section III-B): how far the middle of each bone is from where it was in the reference's pose,
// lattice units. Their sum is the "skeletal motion".
std::vector<double> bone_shifts(const ReferenceMesh& reference, const std::vector<Bone>& bones, const CodedPose& pose);

}  // namespace htvm::internal
