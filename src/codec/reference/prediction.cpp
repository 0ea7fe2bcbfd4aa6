#include "codec/reference/prediction.h"

#include <algorithm>

#include "codec/reference/handle_weights.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

std::vector<LatticePoint> sub_mesh_means(const ReferenceMesh& reference, const std::vector<Bone>& bones) {
    std::vector<LatticePoint> means;
    for (std::size_t bone = 0; bone < bones.size(); ++bone) {
        const auto vertices = reference.sub_meshes.of(bone);
        std::int64_t x = 0, y = 0, z = 0;
        for (const auto v : vertices) {
            x += reference.mesh.positions[v].x;
            y += reference.mesh.positions[v].y;
            z += reference.mesh.positions[v].z;
        }
        const auto n = static_cast<std::int64_t>(vertices.size());
        if (n == 0) {
            means.push_back(reference.joints[bones[bone].first]);
        } else {
            means.push_back({static_cast<std::int32_t>(divide_rounded(x, n)),
                             static_cast<std::int32_t>(divide_rounded(y, n)),
                             static_cast<std::int32_t>(divide_rounded(z, n))});
        }
    }
    return means;
}

bool blends(const ReferenceMesh& reference, std::size_t vertex) {
    return !reference.weights.empty() && reference.weights[vertex].weight[1] > 0;
}

}  // namespace

void skin_reference(ReferenceMesh& reference, const std::vector<Bone>& bones, std::span<const std::int32_t> radii,
                    std::int32_t weight_width, Threads threads) {
    const auto& mesh = reference.mesh;
    reference.bone_of_vertex = skin(mesh.positions, cylinders(bones, reference.joints, radii), threads);
    reference.sub_meshes = group_by_bone(reference.bone_of_vertex, bones.size());
    if (weight_width > 0)
        reference.weights =
            smooth_weights(reference.bone_of_vertex, mesh.positions, mesh.triangles, weight_width, threads);
    reference.pivots = sub_mesh_means(reference, bones);
    reference.mapping_prior = make_mapping_prior(mesh.positions, mesh.triangles);
}

ReferenceMesh make_reference(LatticeMesh mesh, const std::vector<Bone>& bones, std::vector<LatticePoint> joints,
                             std::vector<QuantisedRotation> orientations, std::span<const std::int32_t> radii,
                             std::int32_t weight_width, std::uint32_t frame, Threads threads) {
    ReferenceMesh out;
    out.mesh = std::move(mesh);
    out.joints = std::move(joints);
    out.orientations = std::move(orientations);
    out.frame = frame;
    skin_reference(out, bones, radii, weight_width, threads);
    return out;
}

std::vector<LatticePoint> predict_positions(const ReferenceMesh& reference,
                                            std::span<const QuantisedTransform> transforms, Threads threads) {
    const auto rotation = rotation_matrices(transforms);
    std::vector<LatticePoint> out(reference.mesh.positions.size());
    // Some 10 ns per vertex: a mesh of ordinary size is moved before another thread would be awake.
    parallel_for(out.size(), threads, 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const LatticePoint v = reference.mesh.positions[k];
            const auto bone = reference.bone_of_vertex[k];
            out[k] = blends(reference, k)
                         ? blended_move(v, reference.weights[k], rotation, reference.pivots, transforms)
                         : move(v, rotation[bone], reference.pivots[bone], transforms[bone].shift);
        }
    });
    return out;
}

std::vector<QuantisedNormal> predict_normals(const ReferenceMesh& reference,
                                             std::span<const QuantisedTransform> transforms) {
    const auto rotation = rotation_matrices(transforms);
    std::vector<QuantisedNormal> out;
    out.reserve(reference.mesh.normals.size());
    for (std::size_t k = 0; k < reference.mesh.normals.size(); ++k) {
        const auto& n = reference.mesh.normals[k];
        const LatticePoint normal{n[0], n[1], n[2]};
        const LatticePoint turned = blends(reference, k) ? blended_turn(normal, reference.weights[k], rotation)
                                                         : rotate(rotation[reference.bone_of_vertex[k]], normal);
        out.push_back({turned.x, turned.y, turned.z});
    }
    return out;
}

}  // namespace htvm::internal
