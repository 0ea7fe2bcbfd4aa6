// Rigid registration of point sets: iterative closest points (paper, section IV-B; Besl and McKay 1992).
#pragma once

#include <Eigen/Core>
#include <span>

#include "surface/surface_index.h"

namespace htvm::internal {

// x -> rotation * x + shift.
struct RigidMotion {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return rotation * x + shift; }
    RigidMotion inverse() const { return {rotation.transpose(), -(rotation.transpose() * shift)}; }
    // This one behind `first`.
    RigidMotion operator*(const RigidMotion& first) const { return {rotation * first.rotation, (*this)(first.shift)}; }
};

// The rigid motion that takes `from` nearest to `to` pair by pair in the least-squares sense (Kabsch 1976); needs at
// least one pair. If the pairs leave a turn undetermined (fewer than three, or all in a line), the smallest turn is
// taken.
RigidMotion align(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to);

struct RegistrationOptions {
    int iterations = 12;              // at most; it stops earlier once the motion no longer changes
    std::size_t samples = 400;        // number of points of the frame that are used, evenly spread
    double trim = 0.1;                // share of the worst pairs to leave out in each iteration, such as mis-skinned
                                      // vertices
    std::size_t minimum_points = 12;  // with fewer points on either side, the start is returned
    bool point_to_plane = true;  // where the reference has normals; else the points themselves are brought together
};

// Registers the reference points (in the tree, in their own space) to the frame's points, beginning at `start`; returns
// the motion reference -> frame. normals: one per reference point, or empty. If steps to planes lead far away from the
// frame, the start is returned.
RigidMotion register_points(const NearestPoints& reference, std::span<const Eigen::Vector3f> normals,
                            std::span<const Point3f> frame, const RigidMotion& start,
                            const RegistrationOptions& options);

// Mean squared distance of the sampled frame points to the moved reference, over the nearest (1 - trim) of them.
double registration_error(const NearestPoints& reference, std::span<const Point3f> frame, const RigidMotion& motion,
                          const RegistrationOptions& options);

}  // namespace htvm::internal
