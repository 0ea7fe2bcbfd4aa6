// Registration of a reference mesh that deforms by handles to another mesh's surface: Gauss-Newton steps on the
// distances of closest points, with handles that stay as rigid to their neighbours as the data let them (Sumner,
// Schmid, Pauly 2007; Li, Sumner, Pauly: Global correspondence optimization for non-rigid registration of depth scans,
// 2008). Encoder side: what comes out is quantised before it predicts anything.
//
// Lengths are in the positions' units; the options are in millimetres and say how long one is.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/thread.h"
#include "core/vertex_weights.h"
#include "htvm/mesh.hpp"
#include "surface/rigid_registration.h"
#include "surface/surface_index.h"

namespace htvm::internal {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Which pairs of handles have a block, row < column; block i stands for place[i].
struct BlockPattern {
    std::size_t handles = 0;
    std::vector<std::pair<std::uint16_t, std::uint16_t>> place;  // ascending
    std::vector<std::uint32_t> first;                            // of each row, handles + 1
    // The block of a pair that is in the pattern, row < column.
    std::uint32_t find(std::uint16_t row, std::uint16_t column) const;
};
// pairs in any order, either way round, repeated or not; equal ends are passed over.
BlockPattern make_pattern(std::size_t handles, std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs);

// Symmetric: the blocks below the diagonal are the transposed ones above.
struct BlockSystem {
    std::vector<Matrix6> diagonal, above;  // one per handle; one per place
    std::vector<Vector6> right;
    explicit BlockSystem(const BlockPattern& pattern);
    void clear();
    BlockSystem& operator+=(const BlockSystem& other);
};

// Solves system * x = right by conjugate gradients, preconditioned by the diagonal blocks; stops after `iterations` or
// when the residual has shrunk by `tolerance`. The system must be positive definite.
std::vector<Vector6> solve(const BlockPattern& pattern, const BlockSystem& system, int iterations, double tolerance);

// Two handles that pull on each other: their motions should agree at a point between them (for bones the joint), and
// in how they turn.
struct HandlePair {
    std::uint16_t first = 0, second = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  // in the reference's space
    double shift_stiffness = 1;                       // on the motions' distance at the point
    double turn_stiffness = 0.2;  // on the difference of their turns; of a joint of bones lower still
};

struct DeformationOptions {
    double millimetre = 1;            // one millimetre in the positions' units: 16 on a lattice of 1/16 mm
    int coarse_rounds = 6;            // with groups of handles that move together, for far motion; at most,
    double settled = 2;               // mm: where no group moves farther in a round, the next is the last
    int fine_rounds = 4;              // with all handles
    double coarse_spacing = 180;      // mm between the groups' middles
    double far_reach = 250;           // mm: how far the first coarse round looks for the other surface
    double middle_reach = 120;        // mm: the last coarse round and the first fine one
    double near_reach = 60;           // mm: the last fine round
    std::size_t samples = 4500;       // of the reference's vertices, spread over the handles
    std::size_t back_samples = 3500;  // of the target's vertices, which pull the nearest reference vertex
    double first_stiffness = 1;       // of a handle's ties against its samples: in the coarse rounds and the first fine
    double last_stiffness = 0.01;     // in the last fine round
    double first_point_share = 0.5;   // weight of the distance to the point against that to its plane, likewise
    double last_point_share = 0.2;
    double agreement = 0.2;      // least product of the normals of a match
    int solver_iterations = 40;  // of conjugate gradients, at most, per round
    Threads threads = {};
};

// How some vertices follow the handles, with the blocks of the linear system that each touches.
struct SampleBlend {
    std::array<std::uint16_t, handles_per_vertex> handle{};
    std::array<float, handles_per_vertex> weight{};
    std::array<std::uint32_t, 6> block{};  // of the pairs 01 02 03 12 13 23
    std::uint8_t count = 0;
};

// How a vertex follows its handles; the blocks are left open.
SampleBlend blend_of(const VertexWeights& weights);

// One level of handles over the samples.
struct DeformationLevel {
    std::vector<std::uint32_t> samples;  // among the mesh's samples
    std::vector<SampleBlend> blends;     // one per sample
    std::vector<std::uint32_t> centre;   // handles of the finer level that stand for these; of the finest: 0, 1, 2, ...
    std::vector<HandlePair> pairs;
    BlockPattern pattern;
};

// A reference mesh ready to be deformed; made once per I-frame.
struct DeformableMesh {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    HandleWeights weights;
    std::vector<Eigen::Vector3d> handles;  // positions
    std::vector<std::uint32_t> samples;    // vertices
    std::vector<Point3f> sample_normals;
    float sample_gap = 0;  // about how far apart neighbouring samples are
    DeformationLevel fine, coarse;
    std::vector<SampleBlend> groups;  // how each handle follows the coarse ones
};

// weights: one per vertex, of handles < handles.size(); pairs likewise. Without handles nothing ever moves.
DeformableMesh make_deformable(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                               HandleWeights weights, std::span<const Eigen::Vector3d> handles,
                               std::vector<HandlePair> pairs, const DeformationOptions& options);

// The motions, one per handle, reference -> frame, that lay the reference on the target, from `start` (one per handle;
// or empty: no motion). The same for any number of threads.
std::vector<RigidMotion> register_deformation(const DeformableMesh& mesh, const SurfaceIndex& target,
                                              std::span<const RigidMotion> start, const DeformationOptions& options);

// A start for the next frame: each handle takes the step from `before` to `last` once more. One motion a handle each.
std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last);

// Mean distance of the samples to the target's planes and of the target's samples to the reference, each bounded by
// near_reach: to choose between starts.
double deformation_error(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> motions,
                         const DeformationOptions& options);

// The reference moved, in floats: to look ahead with. What is coded moves in integers.
std::vector<Point3f> deform(const DeformableMesh& mesh, std::span<const RigidMotion> motions, Threads threads);

}  // namespace htvm::internal
