// M1: the point cloud metric of the paper (section VI-A1, equations 9 and 10), for geometry and for colour.
//
// Every vertex of one mesh is compared with the nearest vertex of the other; for colour too, nearest means nearest in
// geometry. Squared differences are summed over all vertices of all frames before the root is taken, so the weight of a
// frame is its number of vertices. It is measured in both directions; the metric is the larger.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm {

// For each point of `from`, the index of its nearest point in `to` (Euclidean distance, computed in double); of several
// at the same distance, the one with the lowest index. Empty if either is empty. The same for any number of threads.
std::vector<std::uint32_t> nearest_vertices(std::span<const Vector3f> from, std::span<const Vector3f> to,
                                            internal::Threads threads = {});

// The sums of eq. 9 in one direction; those of several frames can be added up.
struct PointErrorSums {
    std::uint64_t vertices = 0;         // sum of N_t
    double squared_distance = 0;        // mm^2; infinite once a mesh with vertices was compared with one without any
    double largest_distance = 0;        // mm, of any vertex of any frame
    std::uint64_t colour_vertices = 0;  // vertices of the frames where both meshes have colours
    double squared_colour = 0;          // squared length of the RGB difference, levels^2
};
PointErrorSums& operator+=(PointErrorSums& sums, const PointErrorSums& frame);

// Both directions: forward from the original's vertices to the decoded mesh, backward the opposite way.
struct PointError {
    PointErrorSums forward, backward;
};
PointError& operator+=(PointError& sums, const PointError& frame);

// The sums of one direction, where nearest = nearest_vertices(from.positions, to.positions). All vertices count: leave
// those out before that are not shown (without_hidden_vertices in mesh_measures.h).
PointErrorSums sum_point_errors(const Mesh& from, const Mesh& to, std::span<const std::uint32_t> nearest);

// The sums of one frame in both directions, of the vertices that are shown. A mesh without vertices adds nothing in the
// direction from it, and an infinite distance in the direction to it.
PointError point_error(const Mesh& original, const Mesh& decoded, internal::Threads threads = {});

// Root mean squared difference of eq. 9; 0 if nothing was compared.
double rms_distance(const PointErrorSums& sums);  // mm
double rms_colour(const PointErrorSums& sums);    // levels (the length of an RGB vector, so up to 255 * sqrt(3))

// RMSE of eq. 10: the larger of the two directions.
double m1_geometry(const PointError& sums);  // mm
double m1_colour(const PointError& sums);    // levels

}  // namespace htvm
