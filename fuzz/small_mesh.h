// Small meshes on the lattice for the targets of the layers: grids with holes and folds, or random triangles.
#pragma once

#include <algorithm>
#include <vector>

#include "core/lattice.h"
#include "fuzz_input.h"
#include "htvm/mesh.hpp"

namespace htvm::fuzz {

using namespace internal;

struct SmallMesh {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
};

inline LatticePoint any_point(FuzzInput& input) {
    return {input.number(lattice_limit), input.number(lattice_limit), input.number(lattice_limit)};
}

inline SmallMesh grid(std::uint32_t width, std::uint32_t height) {
    SmallMesh out;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            out.positions.push_back({static_cast<std::int32_t>(x) * 40, static_cast<std::int32_t>(y) * 40, 0});
    for (std::uint32_t y = 0; y + 1 < height; ++y)
        for (std::uint32_t x = 0; x + 1 < width; ++x) {
            const std::uint32_t v = y * width + x;
            out.triangles.push_back({v, v + 1, v + width});
            out.triangles.push_back({v + 1, v + width + 1, v + width});
        }
    return out;
}

// Up to about 300 vertices and 500 triangles; none if the input is short. Any triangles whose corners exist.
inline SmallMesh small_mesh(FuzzInput& input) {
    SmallMesh out;
    const std::uint8_t kind = input.u8();
    if (kind & 1) out = grid(input.below(18), input.below(18));
    for (std::uint32_t n = input.below(kind & 2 ? 64 : 6); n > 0 && input.left() > 0; --n)
        out.positions.push_back(any_point(input));
    if (out.positions.empty()) return out;
    const auto vertices = static_cast<std::uint32_t>(out.positions.size());
    for (std::uint32_t n = input.below(kind & 4 ? 128 : 6); n > 0 && input.left() > 0; --n)
        out.triangles.push_back({input.below(vertices), input.below(vertices), input.below(vertices)});
    // Changes in places: moved vertices; removed, flipped or doubled triangles.
    for (std::uint32_t n = input.below(32); n > 0 && input.left() > 0; --n) {
        const std::uint8_t change = input.u8();
        if (change < 128) {
            auto& p = out.positions[input.below(vertices)];
            p = change < 64 ? any_point(input) : LatticePoint{p.x, p.y, within_lattice(p.z + input.between(-128, 127))};
            continue;
        }
        if (out.triangles.empty()) continue;
        const std::size_t at = input.below(static_cast<std::uint32_t>(out.triangles.size()));
        if (change < 170)
            out.triangles.erase(out.triangles.begin() + static_cast<std::ptrdiff_t>(at));
        else if (change < 210)
            std::swap(out.triangles[at][1], out.triangles[at][2]);
        else
            out.triangles.push_back(out.triangles[at]);
    }
    return out;
}

// Each triangle rotated so that its corners are the lowest sequence of three, then sorted: equal for equal surfaces.
inline std::vector<Triangle> as_set(std::vector<Triangle> triangles) {
    for (auto& t : triangles) t = std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

inline bool names_vertices(const std::vector<Triangle>& triangles, std::size_t vertices) {
    return std::all_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
        return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return v < vertices; });
    });
}

inline bool all_on_lattice(const std::vector<LatticePoint>& points) {
    return std::all_of(points.begin(), points.end(), [](LatticePoint p) { return on_lattice(p); });
}

}  // namespace htvm::fuzz
