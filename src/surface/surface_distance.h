// How far one surface is from another, quickly: the encoder's estimate of M2 (metrics/surface_error.h), to choose and
// to steer by. In the unit of the positions.
//
// Samples are a mesh's vertices and its triangles' centres, both weighted by area. METRO, and so M2, samples mostly
// along edges, where an error that differs from vertex to vertex is larger than in the triangles' middle and smaller
// than at their corners; vertex_share is the mixture that comes closest to it.
// Beside M2, quantised to 1, 2, 4, 8 mm: a synthetic frame of 34,700 vertices +1.6, +0.2, +0.2, +1.2 %, a capture of
// 25,900 (whose soles are large triangles) -0.4, -0.8, -0.5, +0.2 %.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "surface/surface_index.h"

namespace htvm::internal {

// A mesh as it is measured; what the spans show must outlive the call.
struct SurfaceView {
    std::span<const Point3f> positions{};   // finite
    std::span<const Triangle> triangles{};  // every index < positions.size(); none: the vertices are the surface
    std::span<const Colour> colours{};      // one per vertex, or none
};

struct SurfaceDistanceOptions {
    Threads threads = {};       // any number gives the same bits
    std::uint32_t every = 1;    // take only every n-th vertex and every n-th triangle's centre; 0 counts as 1
    double vertex_share = 0.4;  // 0..1, weight of the vertices beside the centres
};

// Mean squares over the samples of one surface against another. Zeros where nothing was sampled; the distance is
// infinite where there was nothing to measure to, the colour 0 where either mesh has none.
struct OneSidedErrors {
    double squared_distance = 0;
    double squared_colour = 0;  // squared length of the RGB difference, levels^2, as in metrics/point_error.h
    double largest_distance = 0;
};

// From samples of `from` to `to`, whose search is given so that it may be built once for many comparisons. Vertices
// that no triangle uses are not sampled. A mesh without triangles, or whose triangles have no area, is sampled at its
// vertices, all alike.
OneSidedErrors one_sided_errors(const SurfaceView& from, const SurfaceView& to, const SurfaceIndex& search_to,
                                const SurfaceDistanceOptions& options = {});

struct SurfaceErrors {
    double geometry_rms = 0;  // RMS distance, the larger direction: comparable with M2
    double colour_rms = 0;    // RMS length of the RGB difference at the closest points, levels, the larger direction
};

// Both ways between two meshes. Two empty meshes are equal; one empty mesh is infinitely far away.
SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceView& b, const SurfaceDistanceOptions& options = {});
// The same with a search of `a` that is there already, for comparing one mesh with several.
SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceIndex& search_a, const SurfaceView& b,
                             const SurfaceDistanceOptions& options = {});

// What the samples of one region are away; sums of several frames add up.
struct RegionErrors {
    std::uint64_t samples = 0;
    double squared_distance = 0;  // sum
    double squared_colour = 0;    // sum, levels^2; 0 without colours
    double largest_distance = 0;
};

// By region of the sampled mesh, e.g. by bone: from every n-th vertex of `from` to the surface of `to`, each vertex
// counting for the region it is labelled with. Labels: one per vertex; those >= regions are left out. Infinite
// distances where `to` is empty.
std::vector<RegionErrors> region_errors(const SurfaceView& from, std::span<const std::uint16_t> labels,
                                        std::size_t regions, const SurfaceView& to, const SurfaceIndex& search_to,
                                        const SurfaceDistanceOptions& options = {});

}  // namespace htvm::internal
