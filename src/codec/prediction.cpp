#include "codec/prediction.h"

#include <algorithm>

#include "core/parallel.h"

namespace htvm {
namespace {

std::int32_t within_lattice(std::int64_t c) {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(c, -std::int64_t{lattice_limit}, std::int64_t{lattice_limit}));
}

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

std::vector<RotationMatrix> matrices(std::span<const QuantisedTransform> transforms) {
    std::vector<RotationMatrix> out;
    for (const auto& t : transforms) out.push_back(rotation_matrix(t.rotation));
    return out;
}

}  // namespace

ReferenceMesh make_reference(LatticeMesh mesh, const std::vector<Bone>& bones, std::vector<LatticePoint> joints,
                             std::vector<QuantisedRotation> orientations, std::span<const std::int32_t> radii,
                             std::uint32_t frame, unsigned threads) {
    ReferenceMesh out;
    out.mesh = std::move(mesh);
    out.joints = std::move(joints);
    out.orientations = std::move(orientations);
    out.frame = frame;
    out.bone_of_vertex = skin(out.mesh.positions, cylinders(bones, out.joints, radii), threads);
    out.sub_meshes = group_by_bone(out.bone_of_vertex, bones.size());
    out.pivots = sub_mesh_means(out, bones);
    out.mapping_prior = make_mapping_prior(out.mesh.positions, out.mesh.triangles);
    return out;
}

LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift) {
    const LatticePoint turned = rotate(matrix, point - pivot);
    return {within_lattice(std::int64_t{turned.x} + pivot.x + shift.x),
            within_lattice(std::int64_t{turned.y} + pivot.y + shift.y),
            within_lattice(std::int64_t{turned.z} + pivot.z + shift.z)};
}

std::vector<LatticePoint> predict_positions(const ReferenceMesh& reference,
                                            std::span<const QuantisedTransform> transforms, unsigned threads) {
    const auto rotation = matrices(transforms);
    std::vector<LatticePoint> out(reference.mesh.positions.size());
    parallel_for(out.size(), threads, 16384, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto bone = reference.bone_of_vertex[k];
            out[k] = move(reference.mesh.positions[k], rotation[bone], reference.pivots[bone], transforms[bone].shift);
        }
    });
    return out;
}

std::vector<QuantisedNormal> predict_normals(const ReferenceMesh& reference,
                                             std::span<const QuantisedTransform> transforms) {
    const auto rotation = matrices(transforms);
    std::vector<QuantisedNormal> out;
    out.reserve(reference.mesh.normals.size());
    for (std::size_t k = 0; k < reference.mesh.normals.size(); ++k) {
        const auto& n = reference.mesh.normals[k];
        const LatticePoint turned = rotate(rotation[reference.bone_of_vertex[k]], {n[0], n[1], n[2]});
        out.push_back({turned.x, turned.y, turned.z});
    }
    return out;
}

}  // namespace htvm
