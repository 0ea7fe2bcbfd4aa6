// D1 and D2: point-to-point and point-to-plane PSNR of the vertices, as in MPEG's point cloud metric (pc_error; Tian,
// Ochimizu, Feng, Cohen, Vetro: Geometric distortion metrics for point cloud compression, 2017).
//
// Each vertex v of one mesh is compared with the nearest vertex h of the other: D1 takes |v - h|^2, D2 the square of (v
// - h) . n, where n is the unit normal at h. The mean over the vertices is the error of one direction; the larger of
// the two directions counts (pc_error's symmetric value), and
//     PSNR = 10 log10(peak^2 / error).
//
// The peak is the diagonal of the original sequence's bounding box unless given. pc_error puts 3 p^2 in the numerator
// for a cube of side p: use peak = p * sqrt(3) to get the same numbers. Where vertices are at the same distance, the
// lowest index is taken, whereas pc_error averages them.
#pragma once

#include <cstdint>
#include <span>

#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm {

// Sums over one direction; those of several frames can be added up.
struct CloudErrorSums {
    std::uint64_t vertices = 0;
    double squared_point = 0;  // mm^2, D1
    double squared_plane = 0;  // mm^2, D2
};
CloudErrorSums& operator+=(CloudErrorSums& sums, const CloudErrorSums& frame);

struct CloudError {
    CloudErrorSums forward, backward;  // forward: from the original's vertices
};
CloudError& operator+=(CloudError& sums, const CloudError& frame);

// One direction, where nearest = nearest_vertices(from.positions, to.positions). The normals are to.normals or, if the
// mesh has none, those of its triangles, weighted by area. A vertex without a normal (no triangle with an area, a zero
// vector) counts with its whole distance. Infinite if there is nothing to compare with.
// All vertices count: leave those out before that are not shown (without_hidden_vertices in mesh_measures.h).
CloudErrorSums sum_cloud_errors(const Mesh& from, const Mesh& to, std::span<const std::uint32_t> nearest);

// One frame, both directions, of the vertices that are shown.
CloudError cloud_error(const Mesh& original, const Mesh& decoded, internal::Threads threads = {});

// 10 log10(peak^2 / error) in dB. Infinity if the error is 0; minus infinity if it is infinite or the peak is 0.
double psnr(double peak, double mean_squared_error);

// The larger mean squared error of the two directions, mm^2; 0 if nothing was compared.
double d1_error(const CloudError& sums);
double d2_error(const CloudError& sums);

// dB; peak in mm.
double d1_psnr(const CloudError& sums, double peak);
double d2_psnr(const CloudError& sums, double peak);

}  // namespace htvm
