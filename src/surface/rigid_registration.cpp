#include "surface/rigid_registration.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

namespace htvm::internal {
namespace {

struct Pair {
    std::uint32_t reference = 0;
    float squared_distance = 0;
    Eigen::Vector3d frame_point;
};

Eigen::Vector3d vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }

// Closest pairs of the sampled frame points, without the worst. A rigid motion keeps distances, so the search can run
// in the reference's space, where the tree is.
std::vector<Pair> closest_pairs(const NearestPoints& reference, std::span<const Point3f> frame,
                                const RigidMotion& motion, const RegistrationOptions& options) {
    const std::size_t count = std::min(options.samples, frame.size());
    const RigidMotion back = motion.inverse();
    std::vector<Pair> pairs;
    pairs.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d v = vector_of(frame[i * frame.size() / count]);
        const Eigen::Vector3f x = back(v).cast<float>();
        const auto nearest = reference.nearest({x.x(), x.y(), x.z()});
        pairs.push_back({nearest.index, nearest.squared_distance, v});
    }
    const auto keep = static_cast<std::size_t>(static_cast<double>(count) * (1 - options.trim) + 0.5);
    if (keep > 0 && keep < count) {
        std::nth_element(pairs.begin(), pairs.begin() + static_cast<std::ptrdiff_t>(keep), pairs.end(),
                         [](const Pair& a, const Pair& b) { return a.squared_distance < b.squared_distance; });
        pairs.resize(keep);
    }
    return pairs;
}

RigidMotion align_pairs(const NearestPoints& reference, const std::vector<Pair>& pairs) {
    std::vector<Eigen::Vector3d> from, to;
    for (const auto& pair : pairs) {
        from.push_back(vector_of(reference.point(pair.reference)));
        to.push_back(pair.frame_point);
    }
    return align(from, to);
}

// One Gauss-Newton step that minimises the distances along the reference's normals (Chen and Medioni 1992).
RigidMotion step_to_planes(const NearestPoints& reference, std::span<const Eigen::Vector3f> normals,
                           const std::vector<Pair>& pairs, const RigidMotion& motion) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& pair : pairs) middle += pair.frame_point;
    middle /= static_cast<double>(pairs.size());
    Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (const auto& pair : pairs) {
        const Eigen::Vector3d moved = motion(vector_of(reference.point(pair.reference)));
        const Eigen::Vector3d normal = motion.rotation * normals[pair.reference].cast<double>();
        Eigen::Matrix<double, 6, 1> row;
        row << (moved - middle).cross(normal), normal;
        matrix += row * row.transpose();
        right += row * normal.dot(pair.frame_point - moved);
    }
    // Motions that the planes do not determine (sliding along a limb, turning about it) stay as they were.
    matrix.diagonal().array() += 1e-3 * (matrix.diagonal().array() + 1.0);
    const Eigen::Matrix<double, 6, 1> x = matrix.ldlt().solve(right);
    const Eigen::Vector3d turn = x.head<3>();
    const double angle = turn.norm();
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    if (angle > 1e-12) rotation = Eigen::AngleAxisd(std::min(angle, 0.5), turn / angle).toRotationMatrix();
    RigidMotion out;
    out.rotation = rotation * motion.rotation;
    out.shift = rotation * (motion.shift - middle) + middle + x.tail<3>();
    return out;
}

bool settled(const RigidMotion& before, const RigidMotion& after) {
    return (after.rotation - before.rotation).norm() < 1e-4 && (after.shift - before.shift).norm() < 0.5;
}

}  // namespace

RigidMotion align(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to) {
    Eigen::Vector3d from_mean = Eigen::Vector3d::Zero(), to_mean = from_mean;
    for (std::size_t i = 0; i < from.size(); ++i) {
        from_mean += from[i];
        to_mean += to[i];
    }
    from_mean /= static_cast<double>(from.size());
    to_mean /= static_cast<double>(from.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double spread = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        covariance += (to[i] - to_mean) * (from[i] - from_mean).transpose();
        spread += (to[i] - to_mean).squaredNorm() + (from[i] - from_mean).squaredNorm();
    }
    // A small multiple of the identity decides a turn that the points leave undetermined.
    covariance += Eigen::Matrix3d::Identity() * (1e-9 * spread + 1e-12);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign(2, 2) = -1;
    RigidMotion motion;
    motion.rotation = svd.matrixU() * sign * svd.matrixV().transpose();
    motion.shift = to_mean - motion.rotation * from_mean;
    return motion;
}

RigidMotion register_points(const NearestPoints& reference, std::span<const Eigen::Vector3f> normals,
                            std::span<const Point3f> frame, const RigidMotion& start,
                            const RegistrationOptions& options) {
    if (reference.size() < options.minimum_points || frame.size() < options.minimum_points) return start;
    RigidMotion motion = start;
    for (int i = 0; i < options.iterations; ++i) {
        const auto pairs = closest_pairs(reference, frame, motion, options);
        const RigidMotion next = options.point_to_plane && !normals.empty()
                                     ? step_to_planes(reference, normals, pairs, motion)
                                     : align_pairs(reference, pairs);
        const bool done = settled(motion, next);
        motion = next;
        if (done) break;
    }
    // Where normals are meaningless, as in a triangle soup, distances to planes are too, and the steps may lead away.
    constexpr double astray = 4;
    if (options.point_to_plane && !normals.empty() &&
        registration_error(reference, frame, motion, options) >
            astray * registration_error(reference, frame, start, options) + 1)
        return start;
    return motion;
}

double registration_error(const NearestPoints& reference, std::span<const Point3f> frame, const RigidMotion& motion,
                          const RegistrationOptions& options) {
    if (reference.size() == 0 || frame.empty()) return 0;
    const auto pairs = closest_pairs(reference, frame, motion, options);
    double sum = 0;
    for (const auto& pair : pairs) sum += pair.squared_distance;
    return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

}  // namespace htvm::internal
