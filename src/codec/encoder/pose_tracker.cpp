#include "codec/encoder/pose_tracker.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "codec/encoder/lattice_motion.h"
#include "core/orientation.h"

namespace htvm::internal {
namespace {

Vector3d middle_of(const Mesh& mesh) {
    Vector3d sum{};
    for (const auto& p : mesh.positions)
        for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += p[axis];
    for (auto& c : sum) c /= static_cast<double>(std::max<std::size_t>(mesh.positions.size(), 1));
    return sum;
}

// One bone through the middle of the mesh, along the longest side of its bounding box.
void stand_in(PoseTracker& tracker, const Mesh& mesh) {
    tracker.has_skeleton = false;
    tracker.skeleton.joint_names = {"low", "high"};
    tracker.skeleton.bones = {{0, 1}};
    Vector3d low = middle_of(mesh), high = low;
    for (const auto& p : mesh.positions)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], static_cast<double>(p[axis]));
            high[axis] = std::max(high[axis], static_cast<double>(p[axis]));
        }
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
        if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
    Vector3d first = middle_of(mesh), second = first;
    first[longest] = low[longest];
    second[longest] = high[longest];
    tracker.rest.joints = {first, second};
}

Result<void> check_pose(const Skeleton& skeleton, const Pose& pose) {
    if (pose.joints.size() != skeleton.joint_names.size())
        return fail(ErrorKind::bad_input, "the pose has " + std::to_string(pose.joints.size()) +
                                              " joints, the skeleton " + std::to_string(skeleton.joint_names.size()));
    if (!pose.orientations.empty() && pose.orientations.size() != skeleton.bones.size())
        return fail(ErrorKind::bad_input, "the pose has " + std::to_string(pose.orientations.size()) +
                                              " orientations, the skeleton " + std::to_string(skeleton.bones.size()) +
                                              " bones");
    for (std::size_t k = 0; k < pose.joints.size(); ++k)
        for (const auto c : pose.joints[k])
            if (!std::isfinite(c)) return fail(ErrorKind::bad_input, "joint " + std::to_string(k) + " is not finite");
    return {};
}

}  // namespace

Result<PoseTracker> make_pose_tracker(const Skeleton& skeleton, const Mesh& first_mesh, const Pose* first_pose) {
    PoseTracker out;
    out.rest_middle = middle_of(first_mesh);
    if (skeleton.bones.empty()) {
        stand_in(out, first_mesh);
    } else {
        if (!first_pose) return fail(ErrorKind::bad_input, "there is a skeleton, but the first frame has no pose");
        out.skeleton = skeleton;
        if (auto ok = check_pose(skeleton, *first_pose); !ok) return tl::unexpected(ok.error());
        out.rest = *first_pose;
    }
    if (out.rest.orientations.empty()) out.rest.orientations = derive_orientations(out.skeleton, out.rest, nullptr);
    out.last = out.rest;
    return out;
}

Result<CodedPose> PoseTracker::next(const Mesh& mesh, const Pose* pose, const Lattice& lattice) {
    Pose now = last;
    if (!has_skeleton) {
        now = rest;
        if (!mesh.positions.empty()) {
            const auto middle = middle_of(mesh);
            // The mesh may reach the end of the lattice; the stand-in skeleton must stay on it.
            const double reach = (lattice_limit / 2 - 1) * lattice.step();
            for (auto& joint : now.joints)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    joint[axis] = std::clamp(joint[axis] + middle[axis] - rest_middle[axis],
                                             lattice.origin[axis] - reach, lattice.origin[axis] + reach);
        }
    } else if (pose) {
        if (auto ok = check_pose(skeleton, *pose); !ok) return tl::unexpected(ok.error());
        now = *pose;
        if (now.orientations.empty()) now.orientations = derive_turning_orientations(skeleton, now, rest);
    }
    CodedPose out;
    for (std::size_t k = 0; k < now.joints.size(); ++k) {
        const auto joint = to_lattice(now.joints[k], lattice);
        if (!joint) return fail(joint.error().kind, "joint " + std::to_string(k) + ": " + joint.error().message);
        out.joints.push_back(*joint);
    }
    for (const auto& orientation : now.orientations)
        out.orientations.push_back(quantise_orientation(orthonormalised(orientation)));
    last = std::move(now);
    return out;
}

}  // namespace htvm::internal
