// Surfaces over a square, whose form is a formula.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/lattice.h"
#include "surface/surface_index.h"

namespace htvm::test {

using namespace internal;

// A square height field of cells x cells, each `cell` lattice units wide, with its middle at the origin, facing +z.
template <class Height>
LatticeMesh height_field(std::int32_t cells, std::int32_t cell, const Height& height) {
    LatticeMesh out;
    const auto at = [&](std::int32_t i) { return (2 * i - cells) * cell / 2; };
    for (std::int32_t y = 0; y <= cells; ++y)
        for (std::int32_t x = 0; x <= cells; ++x)
            out.positions.push_back({at(x), at(y), static_cast<std::int32_t>(std::lround(height(at(x), at(y))))});
    for (std::int32_t y = 0; y < cells; ++y)
        for (std::int32_t x = 0; x < cells; ++x) {
            const auto a = static_cast<std::uint32_t>(y * (cells + 1) + x), b = a + 1;
            const auto c = a + static_cast<std::uint32_t>(cells) + 1, d = c + 1;
            out.triangles.push_back({a, b, d});
            out.triangles.push_back({a, d, c});
        }
    return out;
}

inline double flat(double, double) { return 0; }

inline SurfaceIndex surface_of(const LatticeMesh& mesh) {
    return {points_of(mesh.positions), mesh.triangles, {.cell = 80, .samples = 1000}};
}

}  // namespace htvm::test
