// Mesh skinning: which bone each vertex belongs to (paper, section IV-A, eq. 1-2). Encoder and decoder both skin the
// decoded I-mesh, so everything here is exact: integers, or doubles built from + - * / and sqrt alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/skeleton.hpp"
#include "core/thread.h"

namespace htvm::internal {

using BoneIndex = std::uint16_t;

// The bone cylinders in one frame, on the lattice.
struct BoneCylinder {
    LatticePoint first, second;  // joints j^(i,0) and j^(i,1)
    std::int32_t radius = 0;     // r^i, lattice units
};

// eq. 2: distance to the cylinder's surface (negative inside) where the vertex projects onto the bone's segment, else
// the distance to the nearer joint. Lattice units. A bone of no length has joints only.
double distance_to_bone(LatticePoint vertex, const BoneCylinder& bone);

// eq. 3: distance to the segment where the vertex projects onto it; negative where it does not.
double distance_to_axis(LatticePoint vertex, const BoneCylinder& bone);

// The bone of each vertex: the nearest by eq. 2, of equally near ones the lowest. At least one bone.
std::vector<BoneIndex> skin(std::span<const LatticePoint> vertices, std::span<const BoneCylinder> bones,
                            Threads threads);

// A(b^i) for every bone: vertex indices grouped by bone, ascending within each.
struct SubMeshes {
    std::vector<std::uint32_t> vertices;
    std::vector<std::uint32_t> begin;  // bones + 1 offsets into vertices
    std::span<const std::uint32_t> of(std::size_t bone) const {
        return std::span(vertices).subspan(begin[bone], begin[bone + 1] - begin[bone]);
    }
};
SubMeshes group_by_bone(std::span<const BoneIndex> bone_of_vertex, std::size_t bones);

// The bone cylinders for a pose that is on the lattice.
std::vector<BoneCylinder> cylinders(const std::vector<Bone>& bones, std::span<const LatticePoint> joints,
                                    std::span<const std::int32_t> radii);

}  // namespace htvm::internal
