// Geometry prediction: the reference mesh moved to another frame, bone by bone (paper, section IV-B, eq. 4-5).
#pragma once

#include <span>
#include <vector>

#include "codec/paper/mapping.h"
#include "codec/reference/blending.h"
#include "codec/reference/lattice_mesh.h"
#include "codec/reference/rigid_transform.h"
#include "codec/reference/skinning.h"
#include "core/handles.h"
#include "core/thread.h"

namespace htvm::internal {

// What every EP-frame refers to: the decoded mesh of the last I-frame, skinned, with what both sides derive from it.
struct ReferenceMesh {
    LatticeMesh mesh;
    std::vector<BoneIndex> bone_of_vertex;
    SubMeshes sub_meshes;
    HandleWeights weights;                        // of the bones, one a vertex; empty: each vertex moves with its bone
    std::vector<LatticePoint> pivots;             // one a bone: the mean of its sub-mesh's vertices, or its first joint
    std::vector<LatticePoint> joints;             // of the I-frame's pose
    std::vector<QuantisedRotation> orientations;  // T_I^i of each bone
    MappingPrior mapping_prior;
    std::uint32_t frame = 0;
};

// Skins a reference that has its mesh, joints and orientations, and derives the pivots and the rest. bones must not be
// empty; radii: one per bone. weight_width, lattice units, is that of smooth_weights(); 0: rigid.
void skin_reference(ReferenceMesh& reference, const std::vector<Bone>& bones, std::span<const std::int32_t> radii,
                    std::int32_t weight_width, Threads threads);
// All at once.
ReferenceMesh make_reference(LatticeMesh mesh, const std::vector<Bone>& bones, std::vector<LatticePoint> joints,
                             std::vector<QuantisedRotation> orientations, std::span<const std::int32_t> radii,
                             std::int32_t weight_width, std::uint32_t frame, Threads threads);

// M_P: the reference vertices moved by their bones' transforms, one transform a bone. A vertex of several bones goes to
// the weighted mean of where they move it, rounded once and kept within the lattice.
std::vector<LatticePoint> predict_positions(const ReferenceMesh& reference,
                                            std::span<const QuantisedTransform> transforms, Threads threads);

// The reference's normals turned by their bones' transforms, blended likewise.
std::vector<QuantisedNormal> predict_normals(const ReferenceMesh& reference,
                                             std::span<const QuantisedTransform> transforms);

}  // namespace htvm::internal
