// Closed surfaces around the origin, whose form is a formula.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "core/lattice.h"

namespace htvm::test {

using namespace internal;

// An octahedron whose triangles are halved along each side `times` times and pushed out to a sphere, facing outwards.
// radius: from a direction of unit length.
template <class Radius>
LatticeMesh ball(int times, const Radius& radius) {
    std::vector<Vector3d> directions = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    std::vector<Triangle> triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4},
                                       {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}};
    for (int i = 0; i < times; ++i) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, fresh] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(directions.size()));
            if (fresh) directions.push_back(normalised(directions[a] + directions[b]));
            return at->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : triangles) {
            const auto ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        triangles = std::move(finer);
    }
    LatticeMesh out;
    for (const auto& d : directions) {
        const auto p = d * radius(d);
        const auto whole = [](double c) { return static_cast<std::int32_t>(std::lround(c)); };
        out.positions.push_back({whole(p[0]), whole(p[1]), whole(p[2])});
    }
    out.triangles = std::move(triangles);
    return out;
}

}  // namespace htvm::test
