#include "codec/residual_mapping_enc.h"

#include <algorithm>
#include <optional>

#include "core/parallel.h"

namespace htvm {
namespace {

NearestPoints tree_of(std::span<const LatticePoint> positions) {
    std::vector<Point3f> points;
    points.reserve(positions.size());
    for (const auto p : positions) points.push_back(point_of(p));
    return NearestPoints(points);
}

}  // namespace

std::vector<std::uint32_t> find_reference_vertices(const ReferenceMesh& reference, const ReferenceSearch& search,
                                                   std::span<const LatticePoint> predicted,
                                                   std::span<const QuantisedTransform> transforms,
                                                   std::span<const LatticePoint> frame,
                                                   std::span<const BoneIndex> bone_of_vertex, ReferenceChoice choice,
                                                   unsigned threads) {
    const bool some_bone_is_bare = std::any_of(bone_of_vertex.begin(), bone_of_vertex.end(),
                                               [&](BoneIndex bone) { return search.sub_mesh[bone].size() == 0; });
    std::optional<NearestPoints> all;
    if (choice == ReferenceChoice::any || some_bone_is_bare) all.emplace(tree_of(predicted));
    // The trees stand in the reference's own space: a vertex is taken back there, not the sub-mesh forth.
    std::vector<RigidMotion> back;
    for (std::size_t bone = 0; bone < transforms.size(); ++bone)
        back.push_back(motion_of(transforms[bone], reference.pivots[bone]).inverse());
    std::vector<std::uint32_t> out(frame.size());
    parallel_for(frame.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto bone = bone_of_vertex[k];
            if (choice == ReferenceChoice::any || search.sub_mesh[bone].size() == 0) {
                out[k] = all->nearest(point_of(frame[k])).index;
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

}  // namespace htvm
