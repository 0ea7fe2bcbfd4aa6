// Motion of each bone of an EP-frame relative to its reference: skeletal prediction (paper, eq. 4), refined by
// registration of the bone's sub-meshes (eq. 5). Encoder only: the result is quantised before it is used to predict.
#pragma once

#include <span>
#include <vector>

#include "codec/encoder/lattice_motion.h"
#include "codec/reference/skinning.h"
#include "codec/reference/transforms.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/rigid_registration.h"

namespace htvm::internal {

// The reference's sub-meshes, prepared for nearest-neighbour search; built once per I-frame. Lattice units.
struct ReferenceSearch {
    std::vector<NearestPoints> sub_mesh;                // one per bone
    std::vector<std::vector<Eigen::Vector3f>> normals;  // of the sub-meshes' vertices, from the triangles around them
};
ReferenceSearch make_reference_search(const ReferenceMesh& reference);

// eq. 5: starts each bone from the better of its skeletal motion and its motion in the previous frame (empty at first),
// and registers the reference's sub-mesh to the frame's. frame_sub_meshes: the vertices of the frame, by bone.
std::vector<RigidMotion> register_bones(const ReferenceSearch& reference, std::span<const LatticePoint> frame,
                                        const SubMeshes& frame_sub_meshes, std::span<const RigidMotion> skeletal,
                                        std::span<const RigidMotion> before, const RegistrationOptions& options,
                                        Threads threads);

// How a frame moved relative to its reference: the part that is common to P- and EP-frames.
struct FrameMotion {
    std::vector<BoneIndex> bone_of_vertex;       // one per vertex of the captured mesh
    std::vector<RigidMotion> motion;             // of each bone, as registered; the next frame may start from it
    std::vector<QuantisedTransform> transforms;  // the motion as it is sent
    std::vector<LatticePoint> predicted;         // M_P
};

// What the motion of a frame is found from.
struct MotionReference {
    const ReferenceMesh* reference = nullptr;
    const ReferenceSearch* search = nullptr;
    const std::vector<Bone>* bones = nullptr;
    std::span<const std::int32_t> radii;  // lattice units
    std::span<const RigidMotion> before;  // of the previous frame; empty after an I-frame
};

// Skins the frame, registers its bones, quantises their motion and predicts (paper, section IV-A and IV-B).
FrameMotion find_frame_motion(std::span<const LatticePoint> positions, const CodedPose& pose,
                              const MotionReference& against, const RegistrationOptions& options, Threads threads,
                              std::vector<StageTime>& stages);

// "Per-bone motion" (section III-B): how far the middle of each bone is from where it was in the pose of the reference,
// in lattice units. Their sum is the "skeletal motion".
std::vector<double> bone_shifts(const ReferenceMesh& reference, const std::vector<Bone>& bones, const CodedPose& pose);

}  // namespace htvm::internal
