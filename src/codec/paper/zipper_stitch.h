// Zippering, second half: the gap between two borders is closed with new triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/paper/zipper_surface.h"

namespace htvm::internal::zipping {

// One side of a border: the surface's triangle has it from `to` to `from`, a stitch has it from `from` to `to`.
struct BorderSide {
    std::uint32_t from = 0, to = 0;
    Direction normal;  // of the surface's triangle
};

struct Gap {
    std::span<const LatticePoint> positions;  // coded vertices, then animated ones
    std::span<const Direction> normals;       // of vertices, any length
    std::uint32_t coded_vertices = 0;
    std::span<const BorderSide> coded, animated;
    std::span<const Triangle> around;    // all triangles of the surface that have two border vertices or more
    std::span<const std::uint32_t> cut;  // of `around`, the animated ones: indices, ascending
    double unit = 1;                     // mean side, lattice units
};

// The new triangles, in the order in which they are made.
std::vector<Triangle> stitch(const Gap& gap);

}  // namespace htvm::internal::zipping
