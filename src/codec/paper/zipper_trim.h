// Zippering, first half: which animated triangles stay, and the two borders that face each other across the gap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/paper/zipper_surface.h"
#include "core/thread.h"

namespace htvm::internal::zipping {

// A side of a triangle, from its corner `side` to the next.
struct TriangleSide {
    std::uint32_t triangle = 0, side = 0;
};

struct Trimmed {
    std::vector<std::uint8_t> kept;          // one an animated triangle
    std::vector<std::uint8_t> at_rim;        // one an animated vertex: of kept and of dropped triangles
    std::vector<TriangleSide> coded_seam;    // border sides of `coded` that lie over the part that is still
    std::vector<TriangleSide> animated_cut;  // sides between a kept triangle and a dropped one; the kept one's
};

struct Surface {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
};

// Normals of the vertices with wanted[v] != 0: the sum over the triangles around, in their order, each as long as twice
// its area. Those of other vertices mean nothing.
std::vector<Direction> vertex_normals(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                      std::span<const std::uint8_t> wanted);

// Mean length of the sides of all triangles; 0 where there are none.
double mean_side(const Surface& coded, const Surface& animated);

// unit: mean_side() of both, > 0. still: one an animated vertex.
Trimmed trim(const Surface& coded, const Surface& animated, std::span<const std::uint8_t> still, double unit,
             Threads threads);

}  // namespace htvm::internal::zipping
