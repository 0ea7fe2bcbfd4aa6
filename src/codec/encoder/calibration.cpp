// Skinning calibration (paper, section IV-A, eq. 3).
#include <algorithm>
#include <cmath>

#include "codec/reference/skinning.h"
#include "core/lattice.h"
#include "htvm/encoder.hpp"

namespace htvm {

using namespace internal;
namespace {

// The distances of vertices to the axis of the bone that eq. 3 assigns them to, by bone.
std::vector<std::vector<double>> axis_distances(std::span<const LatticePoint> vertices,
                                                std::span<const BoneCylinder> bones) {
    std::vector<std::vector<double>> out(bones.size());
    for (const auto v : vertices) {
        std::size_t best = bones.size();
        double best_distance = 0;
        for (std::size_t i = 0; i < bones.size(); ++i) {
            const double d = distance_to_axis(v, bones[i]);
            if (d >= 0 && (best == bones.size() || d < best_distance)) {
                best = i;
                best_distance = d;
            }
        }
        if (best < bones.size()) out[best].push_back(best_distance);
    }
    return out;
}

}  // namespace

Result<std::vector<double>> calibrate(const Mesh& mesh, const Skeleton& skeleton, const Pose& pose,
                                      const CalibrationOptions& options) {
    if (!(options.percentile >= 0 && options.percentile <= 100))
        return fail(ErrorKind::bad_input, "the calibration percentile must be within 0 and 100");
    Lattice lattice;
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    lattice.origin = *origin;
    const auto on_lattice = to_lattice(mesh, lattice);
    if (!on_lattice) return tl::unexpected(on_lattice.error());
    std::vector<LatticePoint> joints;
    for (const auto& joint : pose.joints) {
        const auto point = to_lattice(joint, lattice);
        if (!point)
            return fail(point.error().kind, "joint " + std::to_string(joints.size()) + ": " + point.error().message);
        joints.push_back(*point);
    }
    for (const auto& bone : skeleton.bones)
        if (bone.first >= joints.size() || bone.second >= joints.size())
            return fail(ErrorKind::bad_input, "a bone names a joint that the pose does not have");
    const std::vector<std::int32_t> no_radii(skeleton.bones.size(), 0);
    std::vector<double> radii;
    for (auto& distances : axis_distances(on_lattice->positions, cylinders(skeleton.bones, joints, no_radii))) {
        if (distances.empty()) {
            radii.push_back(0);
            continue;
        }
        const auto rank =
            static_cast<std::size_t>(std::lround(options.percentile / 100 * static_cast<double>(distances.size() - 1)));
        std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(rank), distances.end());
        radii.push_back(distances[rank] * lattice.step());
    }
    return radii;
}

}  // namespace htvm
