// Meshes for the tests of intra attributes: connectivity of every awkward kind, and values to go with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::intra_test {

using namespace internal;

struct Connectivity {
    std::size_t vertex_count = 0;
    std::vector<Triangle> triangles;
};

// A regular patch of (size + 1)^2 vertices.
inline Connectivity grid(std::uint32_t size) {
    Connectivity out;
    out.vertex_count = std::size_t{size + 1} * (size + 1);
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x) {
            const std::uint32_t a = y * (size + 1) + x, b = a + 1, c = a + size + 1, d = c + 1;
            out.triangles.push_back({a, b, c});
            out.triangles.push_back({b, d, c});
        }
    return out;
}

// Triangles at random: degenerate, duplicate, non-manifold; some vertices isolated.
inline Connectivity soup(std::mt19937& random) {
    Connectivity out;
    out.vertex_count = 1 + random() % 60;
    const std::size_t triangle_count = random() % 150;
    for (std::size_t i = 0; i < triangle_count; ++i) {
        auto vertex = [&] { return static_cast<std::uint32_t>(random() % out.vertex_count); };
        out.triangles.push_back({vertex(), vertex(), vertex()});
    }
    return out;
}

// Many triangles at one vertex, and many at one edge.
inline Connectivity fans(std::uint32_t blades) {
    Connectivity out;
    out.vertex_count = 2 + std::size_t{blades};
    for (std::uint32_t i = 0; i < blades; ++i) {
        out.triangles.push_back({0, 1, 2 + i});
        out.triangles.push_back({0, 2 + i, 2 + (i + 1) % blades});
    }
    return out;
}

inline std::vector<Connectivity> awkward() {
    std::vector<Connectivity> out{{0, {}},          {1, {}}, {5, {}},  {1, {{0, 0, 0}}},
                                  {3, {{0, 1, 2}}}, grid(1), grid(20), fans(500)};
    for (unsigned seed = 0; seed < 200; ++seed) {
        std::mt19937 random(seed);
        out.push_back(soup(random));
    }
    return out;
}

// Points near a sloping plane; every fifth set spans the whole lattice, including its corners.
inline std::vector<LatticePoint> points(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<LatticePoint> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        auto coordinate = [&](int scale) { return static_cast<std::int32_t>(random() % (2u * scale + 1)) - scale; };
        const auto x = static_cast<std::int32_t>(i % 21) * 9, y = static_cast<std::int32_t>(i / 21) * 9;
        out[i] = {x + coordinate(2), y + coordinate(2), x / 2 + y / 3 + coordinate(1)};
        if (seed % 5 == 0)
            out[i] = random() % 2
                         ? LatticePoint{coordinate(lattice_limit), coordinate(lattice_limit), coordinate(lattice_limit)}
                         : LatticePoint{coordinate(1) * lattice_limit, coordinate(1) * lattice_limit,
                                        coordinate(1) * lattice_limit};
    }
    return out;
}

inline std::vector<Colour> colours(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    const std::uint32_t noise = 1u << (random() % 9);  // 256: nothing but noise
    std::vector<Colour> out(count);
    for (std::size_t i = 0; i < count; ++i)
        for (auto& level : out[i]) level = static_cast<std::uint8_t>(i * 3 + random() % noise);
    return out;
}

}  // namespace htvm::intra_test
