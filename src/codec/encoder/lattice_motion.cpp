#include "codec/encoder/lattice_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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

}  // namespace htvm::internal
