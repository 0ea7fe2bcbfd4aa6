// Motion-based coding (paper, section V), encoder side: which bones' sub-meshes have to be coded, and the part of the
// captured mesh that stands for them.
//
// The paper thresholds the bones' motion alone. Here a bone whose animated sub-mesh is not where the capture's surface
// is, is coded whatever its motion: a tracker that freezes or goes wrong costs bits, not correctness.
#pragma once

#include <span>
#include <vector>

#include "codec/paper/motion_enc.h"
#include "core/thread.h"

namespace htvm::internal {

// How well the predicted mesh stands for the captured one.
struct AnimationFit {
    std::vector<std::uint32_t> nearest;  // of each captured vertex, the nearest vertex of the predicted mesh
    std::vector<float> distance;         // from the captured vertex to the predicted surface, lattice units
    std::vector<double> rms;             // of each bone, both ways: the larger root mean square of such distances
};
// reference must have vertices. both_ways: else only from the captured mesh to the predicted one.
AnimationFit measure_animation(const LatticeMesh& mesh, const ReferenceMesh& reference,
                               std::span<const LatticePoint> predicted, bool both_ways, Threads threads);

// Of each bone, whether it has to be coded: its shift is at least `still_below`, or its sub-mesh fits worse than
// `largest_error` (0: not asked). Lattice units.
std::vector<bool> choose_coded_bones(std::span<const double> shifts, const AnimationFit& fit, double still_below,
                                     double largest_error);

struct MovingPart {
    LatticeMesh mesh;  // the triangles that touch a vertex of the coded bones, and the isolated vertices of those
    std::vector<BoneIndex> bone_of_vertex;
    std::vector<std::uint32_t> nearest;  // of each vertex, as in AnimationFit
};
// A captured vertex belongs to a coded bone where the nearest predicted vertex does: both sides of the seam are cut
// along the same line, however differently the two frames were skinned. So does one farther than `stray` lattice units
// from the predicted mesh: what the reference does not have is coded.
MovingPart cut_moving_part(const LatticeMesh& mesh, std::span<const BoneIndex> bone_of_vertex,
                           const ReferenceMesh& reference, const AnimationFit& fit,
                           const std::vector<bool>& coded_bones, double stray);

}  // namespace htvm::internal
