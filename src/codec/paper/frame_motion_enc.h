// How a frame moved against its reference: what P- and EP-frames of it have in common. Encoder side.
#pragma once

#include <vector>

#include "codec/paper/motion_enc.h"
#include "htvm/encoder.hpp"
#include "core/thread.h"

namespace htvm::internal {

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
