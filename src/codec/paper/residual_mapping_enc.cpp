#include "codec/paper/residual_mapping_enc.h"

#include <algorithm>
#include <optional>

#include "codec/paper/mapping.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

// A bone's vertices are eligible together.
bool is_eligible(const ReferenceMesh& reference, std::span<const std::uint8_t> eligible, std::size_t bone) {
    const auto vertices = reference.sub_meshes.of(bone);
    return !vertices.empty() && (eligible.empty() || eligible[vertices.front()] != 0);
}

NearestPoints tree_of(std::span<const LatticePoint> positions, std::span<const std::uint32_t> chosen) {
    std::vector<Point3f> points;
    points.reserve(chosen.size());
    for (const auto k : chosen) points.push_back(point_of(positions[k]));
    return NearestPoints(points);
}

}  // namespace

std::vector<std::uint32_t> find_reference_vertices(
    const ReferenceMesh& reference, const ReferenceSearch& search, std::span<const LatticePoint> predicted,
    std::span<const QuantisedTransform> transforms, std::span<const LatticePoint> frame,
    std::span<const BoneIndex> bone_of_vertex, std::span<const std::uint32_t> nearest,
    std::span<const std::uint8_t> eligible, ReferenceChoice choice, Threads threads) {
    std::vector<bool> own(transforms.size());  // bones whose vertices refer to the bone's own sub-mesh
    for (std::size_t bone = 0; bone < own.size(); ++bone)
        own[bone] = choice == ReferenceChoice::bone && is_eligible(reference, eligible, bone);
    std::vector<std::uint32_t> candidates;
    std::optional<NearestPoints> all;
    if (!std::all_of(bone_of_vertex.begin(), bone_of_vertex.end(), [&](BoneIndex bone) { return own[bone]; })) {
        candidates = eligible_references(eligible, predicted.size());
        all.emplace(tree_of(predicted, candidates));
    }
    // The trees stand in the reference's own space: a vertex is taken back there, not the sub-mesh forth.
    std::vector<RigidMotion> back;
    for (std::size_t bone = 0; bone < transforms.size(); ++bone)
        back.push_back(motion_of(transforms[bone], reference.pivots[bone]).inverse());
    std::vector<std::uint32_t> out(frame.size());
    parallel_for(frame.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto bone = bone_of_vertex[k];
            if (!own[bone] && !nearest.empty() && (eligible.empty() || eligible[nearest[k]] != 0)) {
                out[k] = nearest[k];
                continue;
            }
            if (!own[bone]) {
                out[k] = candidates[all->nearest(point_of(frame[k])).index];
                continue;
            }
            const Eigen::Vector3d v(frame[k].x, frame[k].y, frame[k].z);
            const Eigen::Vector3f x = back[bone](v).cast<float>();
            out[k] = reference.sub_meshes.of(bone)[search.sub_mesh[bone].nearest({x.x(), x.y(), x.z()}).index];
        }
    });
    return out;
}

ResidualOrder order_residuals(std::span<const std::uint32_t> reference_of_vertex, std::size_t references) {
    std::vector<std::uint32_t> next(references + 1, 0);
    for (const auto r : reference_of_vertex) ++next[r + 1];
    for (std::size_t r = 0; r < references; ++r) next[r + 1] += next[r];
    ResidualOrder out;
    out.vertex.resize(reference_of_vertex.size());
    out.reference.resize(reference_of_vertex.size());
    for (std::size_t k = 0; k < reference_of_vertex.size(); ++k) {
        const auto at = next[reference_of_vertex[k]]++;
        out.vertex[at] = static_cast<std::uint32_t>(k);
        out.reference[at] = reference_of_vertex[k];
    }
    return out;
}

}  // namespace htvm::internal
