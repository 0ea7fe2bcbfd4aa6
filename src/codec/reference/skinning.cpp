#include "codec/reference/skinning.h"

#include <cmath>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

struct Projection {
    bool inside = false;
    double axis_distance = 0;
};

// All integers below fit 53 bits: differences have 26, products 52.
Projection project(LatticePoint v, const BoneCylinder& bone) {
    const LatticePoint u = bone.second - bone.first, d = v - bone.first;
    const double ux = u.x, uy = u.y, uz = u.z, dx = d.x, dy = d.y, dz = d.z;
    const double length2 = ux * ux + uy * uy + uz * uz;
    const double along = ux * dx + uy * dy + uz * dz;
    if (length2 == 0 || along < 0 || along > length2) return {};
    const double cx = uy * dz - uz * dy, cy = uz * dx - ux * dz, cz = ux * dy - uy * dx;
    return {true, std::sqrt((cx * cx + cy * cy + cz * cz) / length2)};
}

}  // namespace

double distance_to_bone(LatticePoint vertex, const BoneCylinder& bone) {
    const auto projection = project(vertex, bone);
    if (projection.inside) return projection.axis_distance - bone.radius;
    const auto to_first = squared_distance(vertex, bone.first), to_second = squared_distance(vertex, bone.second);
    return std::sqrt(static_cast<double>(to_first < to_second ? to_first : to_second));
}

double distance_to_axis(LatticePoint vertex, const BoneCylinder& bone) {
    const auto projection = project(vertex, bone);
    return projection.inside ? projection.axis_distance : -1.0;
}

std::vector<BoneIndex> skin(std::span<const LatticePoint> vertices, std::span<const BoneCylinder> bones,
                            Threads threads) {
    std::vector<BoneIndex> out(vertices.size());
    parallel_for(vertices.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            double best = distance_to_bone(vertices[k], bones[0]);
            for (std::size_t i = 1; i < bones.size(); ++i) {
                const double d = distance_to_bone(vertices[k], bones[i]);
                if (d < best) {
                    best = d;
                    out[k] = static_cast<BoneIndex>(i);
                }
            }
        }
    });
    return out;
}

SubMeshes group_by_bone(std::span<const BoneIndex> bone_of_vertex, std::size_t bones) {
    SubMeshes out;
    out.begin.assign(bones + 1, 0);
    for (const auto bone : bone_of_vertex) ++out.begin[bone + 1u];
    for (std::size_t i = 0; i < bones; ++i) out.begin[i + 1] += out.begin[i];
    out.vertices.resize(bone_of_vertex.size());
    auto next = out.begin;
    for (std::size_t k = 0; k < bone_of_vertex.size(); ++k)
        out.vertices[next[bone_of_vertex[k]]++] = static_cast<std::uint32_t>(k);
    return out;
}

std::vector<BoneCylinder> cylinders(const std::vector<Bone>& bones, std::span<const LatticePoint> joints,
                                    std::span<const std::int32_t> radii) {
    std::vector<BoneCylinder> out;
    for (std::size_t i = 0; i < bones.size(); ++i)
        out.push_back({joints[bones[i].first], joints[bones[i].second], radii[i]});
    return out;
}

}  // namespace htvm::internal
