// Motion-based coding (paper, section V), encoder side: finds which bones' sub-meshes must be coded, and the part of
// the captured mesh that belongs to them.
//
// The paper applies a threshold to the motion of the bones alone. Here a bone is also coded, whatever its motion, if
// its animated sub-mesh does not lie on the captured surface: a tracker that freezes or goes wrong then costs bits, not
// correctness.
#pragma once

#include <span>
#include <vector>

#include "codec/encoder/bones/motion.h"
#include "core/length.h"
#include "core/thread.h"

namespace htvm::internal {

// How well the predicted mesh represents the captured one.
struct AnimationFit {
    std::vector<std::uint32_t> nearest;  // for each captured vertex, the nearest vertex of the predicted mesh
    std::vector<float> distance;         // from each captured vertex to the predicted surface, in lattice units
    std::vector<double> rms;             // for each bone, the larger RMS distance of the two directions
};
// The reference must have vertices. both_ways: if false, only from the captured mesh to the predicted one.
AnimationFit measure_animation(const LatticeMesh& mesh, const ReferenceMesh& reference,
                               std::span<const LatticePoint> predicted, bool both_ways, Threads threads);

// For each bone, whether it must be coded: its shift is at least `still_below`, or its sub-mesh fits worse than
// `largest_error` (0: not checked). shifts: in lattice units.
std::vector<bool> choose_coded_bones(std::span<const double> shifts, const AnimationFit& fit, LatticeUnits still_below,
                                     LatticeUnits largest_error);

struct MovingPart {
    LatticeMesh mesh;  // the triangles that touch a vertex of the coded bones, and the isolated vertices of these bones
    std::vector<BoneIndex> bone_of_vertex;
    std::vector<std::uint32_t> nearest;  // one per vertex, as in AnimationFit
};
// A captured vertex belongs to a coded bone if the nearest predicted vertex does: then both sides of the seam are cut
// along the same line, however differently the two frames were skinned. A vertex farther than `stray` from
// the predicted mesh is coded too, since the reference does not have it.
MovingPart cut_moving_part(const LatticeMesh& mesh, std::span<const BoneIndex> bone_of_vertex,
                           const ReferenceMesh& reference, const AnimationFit& fit,
                           const std::vector<bool>& coded_bones, LatticeUnits stray);

}  // namespace htvm::internal
