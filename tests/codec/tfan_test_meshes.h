// Connectivity of every legal kind, for the tests of TFAN and M-TFAN.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::tfan_test {

using namespace internal;

struct TestMesh {
    std::string name;
    std::uint32_t vertex_count = 0;
    std::vector<Triangle> triangles;
    std::vector<LatticePoint> positions;  // empty: random_positions() are used
};

// Triangles rotated so that the lowest corner comes first, then sorted.
inline std::vector<Triangle> as_multiset(std::vector<Triangle> triangles) {
    for (auto& t : triangles) t = std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

inline TestMesh grid(std::uint32_t width, std::uint32_t height) {
    TestMesh mesh{"grid", width * height, {}, {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            mesh.positions.push_back({static_cast<std::int32_t>(x * 100), static_cast<std::int32_t>(y * 100), 0});
    for (std::uint32_t y = 0; y + 1 < height; ++y)
        for (std::uint32_t x = 0; x + 1 < width; ++x) {
            const std::uint32_t a = y * width + x, b = a + 1, c = a + width, d = c + 1;
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({b, d, c});
        }
    return mesh;
}

// A closed sphere of rings, with random diagonals.
inline TestMesh perturbed_sphere(std::uint32_t rings, std::uint32_t around, unsigned seed) {
    std::mt19937 random(seed);
    TestMesh mesh{"sphere", rings * around + 2, {}, {}};
    const std::uint32_t south = rings * around, north = south + 1;
    for (std::uint32_t r = 0; r < rings; ++r)
        for (std::uint32_t k = 0; k < around; ++k) {
            const double up = 3.14159265 * (r + 1) / (rings + 1), turn = 6.2831853 * k / around;
            mesh.positions.push_back({static_cast<std::int32_t>(5000 * std::sin(up) * std::cos(turn)),
                                      static_cast<std::int32_t>(5000 * std::sin(up) * std::sin(turn)),
                                      static_cast<std::int32_t>(5000 * std::cos(up))});
        }
    mesh.positions.push_back({0, 0, 5000});
    mesh.positions.push_back({0, 0, -5000});
    for (std::uint32_t k = 0; k < around; ++k) {
        const std::uint32_t n = (k + 1) % around, last = (rings - 1) * around;
        mesh.triangles.push_back({south, k, n});
        mesh.triangles.push_back({north, last + n, last + k});
        for (std::uint32_t r = 0; r + 1 < rings; ++r) {
            const std::uint32_t a = r * around + k, b = r * around + n, c = a + around, d = b + around;
            if (random() % 2) {
                mesh.triangles.push_back({a, c, b});
                mesh.triangles.push_back({b, c, d});
            } else {
                mesh.triangles.push_back({a, d, b});
                mesh.triangles.push_back({a, c, d});
            }
        }
    }
    return mesh;
}

inline TestMesh torus(std::uint32_t around, std::uint32_t across) {
    TestMesh mesh{"torus", around * across, {}, {}};
    for (std::uint32_t i = 0; i < around; ++i)
        for (std::uint32_t j = 0; j < across; ++j) {
            const std::uint32_t a = i * across + j, b = i * across + (j + 1) % across;
            const std::uint32_t c = (i + 1) % around * across + j, d = (i + 1) % around * across + (j + 1) % across;
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({b, c, d});
        }
    return mesh;
}

// `count` triangles around vertex 0.
inline TestMesh fan(std::uint32_t count, bool closed) {
    TestMesh mesh{closed ? "closed fan" : "open fan", count + (closed ? 1 : 2), {}, {}};
    for (std::uint32_t i = 0; i < count; ++i)
        mesh.triangles.push_back({0, i + 1, closed && i + 1 == count ? 1 : i + 2});
    return mesh;
}

// Random triangles that all share two hub vertices.
inline TestMesh shuffled_hub(std::uint32_t count) {
    std::mt19937 random(9);
    TestMesh mesh{"shuffled hub", count, {}, {}};
    for (std::uint32_t i = 0; i < count; ++i) {
        const auto a = static_cast<std::uint32_t>(random() % count), b = static_cast<std::uint32_t>(random() % count);
        mesh.triangles.push_back(random() % 2 ? Triangle{0, a, b} : Triangle{0, 1, b});
    }
    return mesh;
}

// Few vertices and any triangles: degenerate, duplicate, non-manifold, of both orientations, isolated vertices.
inline TestMesh random_soup(unsigned seed) {
    std::mt19937 random(seed);
    TestMesh mesh{"soup " + std::to_string(seed), 1 + static_cast<std::uint32_t>(random() % 40), {}, {}};
    const auto any = [&] { return static_cast<std::uint32_t>(random() % mesh.vertex_count); };
    for (std::uint32_t i = 0, n = static_cast<std::uint32_t>(random() % 120); i < n; ++i) {
        const std::uint32_t a = any(), b = any(), kind = static_cast<std::uint32_t>(random() % 8);
        if (kind == 0 && !mesh.triangles.empty()) {
            mesh.triangles.push_back(mesh.triangles[random() % mesh.triangles.size()]);
        } else if (kind == 1) {
            mesh.triangles.push_back({a, a, b});
        } else if (kind == 2) {
            mesh.triangles.push_back({a, b, b});
        } else {
            mesh.triangles.push_back({a, b, any()});
        }
    }
    return mesh;
}

inline std::vector<TestMesh> special_meshes() {
    std::vector<TestMesh> meshes = {{"no vertex", 0, {}, {}},
                                    {"isolated vertices", 5, {}, {}},
                                    {"one triangle", 3, {{0, 1, 2}}, {}},
                                    {"one triangle the other way", 3, {{0, 2, 1}}, {}},
                                    {"both ways", 3, {{0, 1, 2}, {0, 2, 1}}, {}},
                                    {"duplicates", 4, {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 1, 3}}, {}},
                                    {"three at an edge", 5, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}, {}},
                                    {"two at a vertex", 5, {{0, 1, 2}, {0, 3, 4}}, {}},
                                    {"degenerate", 3, {{0, 0, 1}, {1, 2, 2}, {2, 1, 2}, {0, 1, 2}}, {}},
                                    {"a point", 1, {{0, 0, 0}, {0, 0, 0}}, {}},
                                    {"tetrahedron", 4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}, {}}};
    meshes.push_back(grid(9, 7));
    meshes.push_back(perturbed_sphere(15, 20, 2));
    meshes.push_back(torus(12, 9));
    meshes.push_back(fan(300, true));
    meshes.push_back(fan(300, false));
    auto mixed = grid(20, 20);
    mixed.name = "mixed orientation";
    std::mt19937 random(4);
    for (auto& triangle : mixed.triangles)
        if (random() % 2) std::swap(triangle[1], triangle[2]);
    meshes.push_back(mixed);
    TestMesh components{"many components", 0, {}, {}};
    for (std::uint32_t i = 0; i < 50; ++i, components.vertex_count += 5)
        for (const auto& t : {Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 3, 1}, Triangle{1, 3, 2}})
            components.triangles.push_back({t[0] + i * 5, t[1] + i * 5, t[2] + i * 5});
    meshes.push_back(components);
    auto holes = perturbed_sphere(30, 30, 8);
    holes.name = "holes";
    std::erase_if(holes.triangles, [&](const Triangle&) { return random() % 5 == 0; });
    meshes.push_back(holes);
    return meshes;
}

// The mesh's own positions, or random ones, many of them equal.
inline std::vector<LatticePoint> positions_of(const TestMesh& mesh, unsigned seed) {
    if (mesh.positions.size() == mesh.vertex_count) return mesh.positions;
    std::mt19937 random(seed);
    std::vector<LatticePoint> positions(mesh.vertex_count);
    const auto coordinate = [&] { return static_cast<std::int32_t>(random() % 9) * 64 - 256; };
    for (auto& p : positions) p = {coordinate(), coordinate(), coordinate()};
    return positions;
}

// Truncated, with a flipped bit, or with a replaced byte.
inline std::vector<std::uint8_t> damage(std::vector<std::uint8_t> bytes, std::mt19937& random) {
    if (bytes.empty()) return bytes;
    const auto at = random() % bytes.size();
    const auto kind = random() % 3;
    if (kind == 0) bytes.resize(at);
    if (kind == 1) bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << random() % 8));
    if (kind == 2) bytes[at] = static_cast<std::uint8_t>(random());
    return bytes;
}

}  // namespace htvm::tfan_test
