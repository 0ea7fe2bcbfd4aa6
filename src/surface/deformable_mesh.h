// A reference mesh prepared for deformation by handles (surface/tracked_registration.h): which of its vertices are
// matched, how they follow handles, and handles in groups. Built once per I- or TP-frame. Encoder only.
//
// Positions are in lattice units, as are lengths that are no more than numbers; options are in millimetres on an adult
// and say how long one is.
#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/length.h"
#include "core/thread.h"
#include "core/vertex_weights.h"
#include "htvm/mesh.hpp"
#include "surface/block_system.h"
#include "surface/place_graph.h"
#include "surface/surface_index.h"
#include "surface/vertex_fans.h"

namespace htvm::internal {

// Two handles that pull on each other: their motions should agree at a point between them (for bones, the joint), and
// their turns should agree.
struct HandlePair {
    std::uint16_t first = 0, second = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  // in the space of the reference
    double shift_stiffness = 1;                       // weight of the difference of the two motions at the point
    double turn_stiffness = 0.2;  // weight of the difference of their turns; lower still at a joint between bones
};

// The defaults are those of the usual effort (codec/encoder/tracked/tracking_effort.h).
struct DeformationOptions {
    Scale scale;                  // of the lattice on which the positions are
    int coarse_rounds = 6;        // most rounds with groups of handles that move together, to cover large motion
    AdultMillimetres settled{2};  // once no group moves farther than this in a round, the next is the last
    int fine_rounds = 3;          // rounds with all handles
    AdultMillimetres coarse_spacing{180};  // between the centres of groups
    AdultMillimetres far_reach{250};       // search distance of the first coarse round
    AdultMillimetres middle_reach{120};    // of the last coarse round and the first fine one
    AdultMillimetres near_reach{60};       // of the last fine round
    std::size_t samples = 4500;            // number of vertices of the reference, spread over the handles
    std::size_t back_samples = 3500;  // number of vertices of the target, each of which pulls the nearest vertex of
                                      // the reference
    double first_stiffness = 1;       // of a handle's ties relative to its samples: in the coarse rounds and the first
                                      // fine one
    double last_stiffness = 0.01;     // the same in the last fine round
    double first_point_share = 0.5;   // weight of the distance to the matched point relative to that to its plane, in
                                      // the same rounds
    double last_point_share = 0.2;
    double agreement = 0.2;      // least dot product of the normals of a match
    int solver_iterations = 25;  // at most, of conjugate gradients, per round
    int colour_rounds = 3;       // last fine rounds in which colours are matched as well, where both sides have them
    double colour_weight = 5;  // mm^2 on an adult: variance of a distance that counts as much as the noise of a colour
                               // does
    int surface_rounds = 3;    // last fine rounds in which the target is matched to the reference's triangles, not to
                               // its vertices alone
    // Whether both surfaces may end where the other goes on, as views of depth cameras do: what is matched to a border
    // from beyond it then says nothing.
    bool open = false;
    std::span<const std::uint8_t> present = {};  // one per vertex of the reference, 0 where nothing was seen of it
                                                 // lately: it is matched to what is near alone; or none
    AdultMillimetres unseen_reach{10};           // how near
    Threads threads = {};
    const std::atomic<bool>* in_vain = nullptr;  // once it is set no more rounds are made: nobody wants the result
};

// How a vertex follows the handles, and the blocks of the linear system that it touches.
struct SampleBlend {
    std::array<std::uint16_t, handles_per_vertex> handle{};
    std::array<float, handles_per_vertex> weight{};
    std::array<std::uint32_t, 6> block{};  // for the pairs 01 02 03 12 13 23
    std::uint8_t count = 0;
};

// How a vertex follows its handles; the blocks are not filled in.
SampleBlend blend_of(const VertexWeights& weights);

// For each sample those that are beside it on the surface, in compressed rows.
struct SamplesBeside {
    std::vector<std::uint32_t> first, samples;
    std::span<const std::uint32_t> of(std::size_t sample) const {
        return std::span(samples).subspan(first[sample], first[sample + 1] - first[sample]);
    }
};

// One level of handles, and the samples they move.
struct DeformationLevel {
    std::vector<std::uint32_t> samples;  // indices into the mesh's samples
    std::vector<SampleBlend> blends;     // one per sample
    SamplesBeside beside;                // each of them, among them
    std::vector<std::uint32_t> centre;   // the handle of the finer level at the centre of each group; on the finest
                                         // level 0, 1, 2, ...
    std::vector<HandlePair> pairs;
    BlockPattern pattern;
};

// The reference's colour at a sample, and how it changes along the surface at rest.
struct SampleTexture {
    Eigen::Vector3f colour = Eigen::Vector3f::Zero();  // levels
    Eigen::Matrix3f slope = Eigen::Matrix3f::Zero();   // a row per component: levels per unit of the positions
    float trust = 0;       // 1: the neighbours' colours lie on the slope; 0: they could as well be chance
    float unevenness = 0;  // mean square of their distances from it, levels^2
};

// A reference mesh prepared for deformation; built once per I-frame.
struct DeformableMesh {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    TrianglesAround around;  // each vertex
    HandleWeights weights;
    std::vector<SampleBlend> blends;       // the same, one per vertex
    std::vector<Eigen::Vector3d> handles;  // positions of the handles
    std::vector<std::uint32_t> samples;    // indices of vertices
    std::vector<std::uint32_t> sample_of;  // for each vertex, the sample that is the fewest edges away, or
                                           // OrientedPoints::no_point
    std::vector<VertexFan> sample_fans;    // one per sample, at rest
    std::vector<Point3f> sample_normals;
    std::vector<std::uint8_t> sample_from_border;  // one per sample: edges_from_border(); none unless options.open
    std::vector<SampleTexture> sample_textures;    // one per sample, or none if nothing is textured
    float sample_gap = 0;                          // approximate spacing of neighbouring samples
    DeformationLevel fine, coarse;
    std::vector<SampleBlend> groups;  // how each handle follows the groups
};

// The handles, as they lie at rest; those of a pair are beside each other.
PlaceGraph graph_of_handles(const DeformableMesh& mesh);

// weights: one per vertex, with handles < handles.size(); pairs likewise. Without handles, nothing ever moves. colours:
// one per vertex, or none.
DeformableMesh make_deformable(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                               HandleWeights weights, std::span<const Eigen::Vector3d> handles,
                               std::vector<HandlePair> pairs, const DeformationOptions& options,
                               std::span<const Colour> colours = {});

}  // namespace htvm::internal
