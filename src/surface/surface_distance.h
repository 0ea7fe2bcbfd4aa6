// The distance between two surfaces, computed quickly: the encoder's estimate of M2 (metrics/surface_error.h), by which
// it chooses and controls quality. In the unit of the positions.
//
// The samples are a mesh's vertices and the centres of its triangles, both weighted by area. METRO, and so M2, samples
// mostly along edges. There, an error that differs from vertex to vertex is larger than in the middle of triangles and
// smaller than at their corners; vertex_share is the mixture that comes closest to it. Deviation from M2, with
// positions quantised to 1, 2, 4, 8 mm: on a synthetic frame of 34,700 vertices +1.6, +0.2, +0.2, +1.2 %; on a capture
// of 25,900 (whose soles are large triangles) -0.4, -0.8, -0.5, +0.2 %.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "surface/surface_index.h"

namespace htvm::internal {

// The mesh to measure; what the spans refer to must outlive the call.
struct SurfaceView {
    std::span<const Point3f> positions{};   // finite
    std::span<const Triangle> triangles{};  // every index < positions.size(); if there are none, the vertices are the
                                            // surface
    std::span<const Colour> colours{};      // one per vertex, or none
};

struct SurfaceDistanceOptions {
    Threads threads = {};       // the number of threads does not change the result
    std::uint32_t every = 1;    // take only every n-th vertex and every n-th triangle's centre; 0 counts as 1
    double vertex_share = 0.4;  // 0..1, the weight of the vertices against that of the centres
};

// Mean squares over the samples of one surface, measured to another. Zero if nothing was sampled. The distance is
// infinite if there was nothing to measure to; the colour error is 0 if either mesh has no colours.
struct OneSidedErrors {
    double squared_distance = 0;
    double squared_colour = 0;  // squared length of the RGB difference, levels^2, as in metrics/point_error.h
    double largest_distance = 0;
};

// From samples of `from` to `to`, whose search is passed in so that it can serve many comparisons. Vertices that no
// triangle uses are not sampled. A mesh without triangles, or whose triangles have no area, is sampled at its vertices
// with equal weights.
OneSidedErrors one_sided_errors(const SurfaceView& from, const SurfaceView& to, const SurfaceIndex& search_to,
                                const SurfaceDistanceOptions& options = {});

struct SurfaceErrors {
    double geometry_rms = 0;  // RMS distance, the larger direction: comparable with M2
    double colour_rms = 0;    // RMS length of the RGB difference at the closest points, levels, the larger direction
};

// Both directions between two meshes. Two empty meshes are equal; an empty mesh is infinitely far from any other.
SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceView& b, const SurfaceDistanceOptions& options = {});
// The same with an existing search of `a`, for comparing one mesh with several.
SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceIndex& search_a, const SurfaceView& b,
                             const SurfaceDistanceOptions& options = {});

}  // namespace htvm::internal
