// Which cells of a grid a triangle covers: those whose centres lie inside. Triangles that share an edge and lie on
// different sides of it cover no cell twice, and miss none between them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace htvm::internal {

// Coordinates of raster corners are in cells times 2^raster_bits, and below 2^27 in size.
inline constexpr int raster_bits = 6;
using RasterPoint = std::array<std::int32_t, 2>;

// Cells, the last ones excluded.
struct RasterBounds {
    std::int32_t left = 0, bottom = 0, right = 0, top = 0;
};

// Calls at(x, y) for each cell within the bounds, row by row. A triangle may be wound either way.
template <class At>
void for_each_cell(std::array<RasterPoint, 3> corners, const RasterBounds& bounds, const At& at) {
    constexpr std::int32_t cell = 1 << raster_bits;
    const auto edge = [](const RasterPoint& a, const RasterPoint& b, std::int64_t x, std::int64_t y) {
        return (std::int64_t{b[0]} - a[0]) * (y - a[1]) - (std::int64_t{b[1]} - a[1]) * (x - a[0]);
    };
    const auto area = edge(corners[0], corners[1], corners[2][0], corners[2][1]);
    if (area == 0) return;
    if (area < 0) std::swap(corners[1], corners[2]);
    const RasterPoint &a = corners[0], &b = corners[1], &c = corners[2];
    const auto first = [&](std::size_t axis) {  // the first cell whose centre is not before the triangle
        return (std::min({a[axis], b[axis], c[axis]}) + cell / 2 - 1) >> raster_bits;
    };
    const auto last = [&](std::size_t axis) {
        return (std::max({a[axis], b[axis], c[axis]}) - cell / 2) >> raster_bits;
    };
    const std::int32_t left = std::max(first(0), bounds.left), right = std::min(last(0) + 1, bounds.right);
    const std::int32_t bottom = std::max(first(1), bounds.bottom), top = std::min(last(1) + 1, bounds.top);
    if (left >= right || bottom >= top) return;
    // Points on an edge belong to the triangle on one side of it.
    const auto edge_of = [&](const RasterPoint& from, const RasterPoint& to) {
        const bool owns = to[1] < from[1] || (to[1] == from[1] && to[0] > from[0]);
        const std::int64_t x = std::int64_t{left} * cell + cell / 2, y = std::int64_t{bottom} * cell + cell / 2;
        return std::array<std::int64_t, 3>{edge(from, to, x, y) - (owns ? 0 : 1),
                                           -(std::int64_t{to[1]} - from[1]) * cell,
                                           (std::int64_t{to[0]} - from[0]) * cell};
    };
    auto ab = edge_of(a, b), bc = edge_of(b, c), ca = edge_of(c, a);
    for (std::int32_t y = bottom; y < top; ++y) {
        auto p = ab[0], q = bc[0], r = ca[0];
        for (std::int32_t x = left; x < right; ++x, p += ab[1], q += bc[1], r += ca[1])
            if ((p | q | r) >= 0) at(x, y);
        ab[0] += ab[2], bc[0] += bc[2], ca[0] += ca[2];
    }
}

}  // namespace htvm::internal
