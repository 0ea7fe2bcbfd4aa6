#include "codec/paper/frame_motion_enc.h"

#include <cmath>

#include "codec/stage_clock_enc.h"

namespace htvm::internal {

FrameMotion find_frame_motion(std::span<const LatticePoint> positions, const CodedPose& pose,
                              const MotionReference& against, const RegistrationOptions& options, Threads threads,
                              std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const auto& reference = *against.reference;
    FrameMotion out;
    out.bone_of_vertex = skin(positions, cylinders(*against.bones, pose.joints, against.radii), threads);
    const auto sub_meshes = group_by_bone(out.bone_of_vertex, against.bones->size());
    clock.done("skinning");
    const auto skeletal = skeletal_motion(reference, *against.bones, pose);
    out.motion = register_bones(*against.search, positions, sub_meshes, skeletal, against.before, options, threads);
    for (std::size_t i = 0; i < out.motion.size(); ++i)
        out.transforms.push_back(quantise_motion(out.motion[i], reference.pivots[i]));
    clock.done("registration");
    out.predicted = predict_positions(reference, out.transforms, threads);
    clock.done("prediction");
    return out;
}

std::vector<double> bone_shifts(const ReferenceMesh& reference, const std::vector<Bone>& bones, const CodedPose& pose) {
    std::vector<double> out;
    for (const auto& bone : bones) {
        const LatticePoint first = pose.joints[bone.first] - reference.joints[bone.first];
        const LatticePoint second = pose.joints[bone.second] - reference.joints[bone.second];
        const double x = (first.x + second.x) / 2.0, y = (first.y + second.y) / 2.0, z = (first.z + second.z) / 2.0;
        out.push_back(std::sqrt(x * x + y * y + z * z));
    }
    return out;
}

}  // namespace htvm::internal
