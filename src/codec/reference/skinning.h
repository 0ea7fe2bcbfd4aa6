// The skinned reference mesh: which bone each vertex belongs to (paper, section IV-A, eq. 1-2), how smoothly the bones
// blend into each other, and where the vertices of the reference are predicted in another frame (section IV-B, eq.
// 4-5). Encoder and decoder both derive all of it from the decoded I-mesh, so nothing is sent for it. Everything is
// exact: integers, or doubles computed with + - * / and sqrt alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/mapping_prior.h"
#include "codec/reference/transforms.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "core/vertex_weights.h"
#include "htvm/mesh.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::internal {

using BoneIndex = std::uint16_t;

// The bone cylinders in one frame, on the lattice.
struct BoneCylinder {
    LatticePoint first, second;  // joints j^(i,0) and j^(i,1)
    std::int32_t radius = 0;     // r^i, lattice units
};

// eq. 2: if the vertex projects onto the bone's segment, its distance to the cylinder's surface (negative inside);
// otherwise its distance to the nearer joint. Lattice units. For a bone without length, only the joints count.
double distance_to_bone(LatticePoint vertex, const BoneCylinder& bone);

// eq. 3: distance to the segment if the vertex projects onto it; otherwise negative.
double distance_to_axis(LatticePoint vertex, const BoneCylinder& bone);

// The bone of each vertex: the nearest by eq. 2; of equally near ones, the lowest. At least one bone.
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

// Each vertex has a handle of its own (with bones: its bone; with nodes: the nearest one along the mesh). On the border
// between two handles both have the same weight. Away from it, along the edges of the mesh, the weight of the other
// handle falls linearly to 0 at half the width, so the border is `width` lattice units wide. At most the nearest three
// other handles count. docs/bitstream.md, section 7.4.
//
// handle_of_vertex: one per position; triangles index positions; width: 0..lattice_limit, 0: each vertex follows its
// own handle only. Vertices without triangles keep their handle. The result is the same for any number of threads.
// About 3 ms for 35,000 vertices and 14 bones.
HandleWeights smooth_weights(std::span<const std::uint16_t> handle_of_vertex, std::span<const LatticePoint> positions,
                             std::span<const Triangle> triangles, std::int32_t width, Threads threads);

// What every EP-frame refers to: the decoded, skinned mesh of the last I-frame, with what both sides derive from it.
struct ReferenceMesh {
    LatticeMesh mesh;
    std::vector<BoneIndex> bone_of_vertex;
    SubMeshes sub_meshes;
    HandleWeights weights;             // of bones, one per vertex; empty: each vertex moves with its bone alone
    std::vector<LatticePoint> pivots;  // one per bone: the mean of its sub-mesh's vertices, or its first joint if there
                                       // are none
    std::vector<LatticePoint> joints;  // of the I-frame's pose
    std::vector<QuantisedRotation> orientations;  // T_I^i of each bone
    MappingPrior mapping_prior;
    std::uint32_t frame = 0;
};

// Skins a reference whose mesh, joints and orientations are set, and derives the pivots and everything else. bones must
// not be empty; radii: one per bone. weight_width: that of smooth_weights(), in lattice units; 0: rigid.
void skin_reference(ReferenceMesh& reference, const std::vector<Bone>& bones, std::span<const std::int32_t> radii,
                    std::int32_t weight_width, Threads threads);
// Sets the members and skins in one call.
ReferenceMesh make_reference(LatticeMesh mesh, const std::vector<Bone>& bones, std::vector<LatticePoint> joints,
                             std::vector<QuantisedRotation> orientations, std::span<const std::int32_t> radii,
                             std::int32_t weight_width, std::uint32_t frame, Threads threads);

// M_P: the reference vertices moved by the transforms of their bones, one transform per bone. A vertex of several bones
// goes to the weighted mean of the places where they move it, rounded once and clamped to the lattice.
std::vector<LatticePoint> predict_positions(const ReferenceMesh& reference,
                                            std::span<const QuantisedTransform> transforms, Threads threads);

// The reference's normals turned by the transforms of their bones, blended in the same way.
std::vector<QuantisedNormal> predict_normals(const ReferenceMesh& reference,
                                             std::span<const QuantisedTransform> transforms);

}  // namespace htvm::internal
