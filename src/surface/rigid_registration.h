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
};

// The rigid motion that takes `from` nearest to `to` in the least-squares sense (Kabsch 1976), pair by pair; at least
// one pair. Where the pairs leave a turn open (fewer than three, or in a line), it is the one nearest to none.
RigidMotion align(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to);

struct RegistrationOptions {
    int iterations = 12;              // at most; stops when the motion no longer changes
    std::size_t samples = 400;        // points of the frame used, evenly spread
    double trim = 0.1;                // share of the worst pairs left out in each iteration: mis-skinned vertices
    std::size_t minimum_points = 12;  // with fewer on either side the start is returned
    bool point_to_plane = false;      // needs normals
};

// Moves the reference points (in the tree, in their own space) onto the frame's points: from `start`, returns the
// motion reference -> frame. normals: one per reference point, or empty. Steps to planes that lead far away from the
// frame give back the start.
RigidMotion register_points(const NearestPoints& reference, std::span<const Eigen::Vector3f> normals,
                            std::span<const Point3f> frame, const RigidMotion& start,
                            const RegistrationOptions& options);

// The mean squared distance of the nearest (1 - trim) of the sampled frame points to the moved reference.
double registration_error(const NearestPoints& reference, std::span<const Point3f> frame, const RigidMotion& motion,
                          const RegistrationOptions& options);

}  // namespace htvm::internal
