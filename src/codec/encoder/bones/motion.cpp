#include "codec/encoder/bones/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "codec/encoder/stage_clock.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

Eigen::Vector3d vector_of(LatticePoint p) { return {p.x * 1.0, p.y * 1.0, p.z * 1.0}; }

LatticePoint rounded(const Eigen::Vector3d& v) {
    auto whole = [](double c) {
        return static_cast<std::int32_t>(std::lround(std::clamp(c, -1.0 * lattice_limit, 1.0 * lattice_limit)));
    };
    return {whole(v.x()), whole(v.y()), whole(v.z())};
}

}  // namespace

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

Eigen::Matrix3d matrix_of(const QuantisedRotation& rotation) {
    const auto m = rotation_matrix(rotation);
    Eigen::Matrix3d out;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            out(row, column) = static_cast<double>(m[static_cast<std::size_t>(3 * row + column)]) / (1 << matrix_bits);
    return out;
}

QuantisedRotation quantise_orientation(const Rotation& orientation) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(orientation.data());
    const Eigen::Quaterniond q(Eigen::Matrix3d{matrix});
    return quantise_rotation({q.w(), q.x(), q.y(), q.z()});
}

std::vector<RigidMotion> skeletal_motion(const ReferenceMesh& reference, const std::vector<Bone>& bones,
                                         const CodedPose& pose) {
    std::vector<RigidMotion> out;
    for (std::size_t i = 0; i < bones.size(); ++i) {
        RigidMotion motion;
        motion.rotation = matrix_of(pose.orientations[i]) * matrix_of(reference.orientations[i]).transpose();
        motion.shift =
            vector_of(pose.joints[bones[i].first]) - motion.rotation * vector_of(reference.joints[bones[i].first]);
        out.push_back(motion);
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

QuantisedTransform quantise_motion(const RigidMotion& motion, LatticePoint pivot) {
    const Eigen::Quaterniond q(motion.rotation);
    QuantisedTransform out;
    out.rotation = quantise_rotation({q.w(), q.x(), q.y(), q.z()});
    out.shift = rounded(motion(vector_of(pivot)) - vector_of(pivot));
    return out;
}

RigidMotion motion_of(const QuantisedTransform& transform, LatticePoint pivot) {
    RigidMotion out;
    out.rotation = matrix_of(transform.rotation);
    out.shift = vector_of(pivot) + vector_of(transform.shift) - out.rotation * vector_of(pivot);
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
