#include "codec/encoder/bones/motion.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.h"
#include "core/stage_clock.h"

namespace htvm::internal {
ReferenceSearch make_reference_search(const ReferenceMesh& reference) {
    ReferenceSearch out;
    const auto normals = vertex_normals(reference.mesh.positions, reference.mesh.triangles);
    for (std::size_t bone = 0; bone < reference.pivots.size(); ++bone) {
        std::vector<Point3f> points;
        out.normals.emplace_back();
        for (const auto v : reference.sub_meshes.of(bone)) {
            points.push_back(point_of(reference.mesh.positions[v]));
            out.normals.back().push_back(Eigen::Map<const Eigen::Vector3d>(normals[v].data()).cast<float>());
        }
        out.sub_mesh.emplace_back(points);
    }
    return out;
}

std::vector<RigidMotion> register_bones(const ReferenceSearch& reference, std::span<const LatticePoint> frame,
                                        const SubMeshes& frame_sub_meshes, std::span<const RigidMotion> skeletal,
                                        std::span<const RigidMotion> before, const RegistrationOptions& options,
                                        Threads threads) {
    std::vector<RigidMotion> out(skeletal.begin(), skeletal.end());
    std::atomic<std::size_t> next{0};
    auto work = [&](std::size_t, std::size_t) {
        for (std::size_t bone = next++; bone < out.size(); bone = next++) {
            std::vector<Point3f> points;
            for (const auto v : frame_sub_meshes.of(bone)) points.push_back(point_of(frame[v]));
            const auto& sub_mesh = reference.sub_mesh[bone];
            if (!before.empty() && registration_error(sub_mesh, points, before[bone], options) <
                                       registration_error(sub_mesh, points, out[bone], options))
                out[bone] = before[bone];
            out[bone] = register_points(sub_mesh, reference.normals[bone], points, out[bone], options);
        }
    };
    // Each thread takes the next bone that is left, since sub-meshes differ greatly in size.
    parallel_for(std::min<std::size_t>(threads.count, out.size()), threads, 1, work);
    return out;
}

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
