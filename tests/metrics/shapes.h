// Meshes of known geometry for the tests of the metrics.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "htvm/mesh.hpp"

namespace htvm::shapes {

// size x size mm in the plane z = height, cells x cells squares of two triangles, facing +z.
inline Mesh plane(float size, std::uint32_t cells, float height) {
    Mesh mesh;
    const float step = size / static_cast<float>(cells);
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x)
            mesh.positions.push_back({static_cast<float>(x) * step, static_cast<float>(y) * step, height});
    for (std::uint32_t y = 0; y < cells; ++y)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t v = y * (cells + 1) + x;
            mesh.triangles.push_back({v, v + 1, v + cells + 2});
            mesh.triangles.push_back({v, v + cells + 2, v + cells + 1});
        }
    return mesh;
}

// An octahedron whose triangles are split in four `splits` times, every vertex at `radius` from the origin.
inline Mesh sphere(double radius, int splits) {
    Mesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int s = 0; s < splits; ++s) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, added] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
            if (added) {
                Vector3f m;
                for (std::size_t i = 0; i < 3; ++i) m[i] = (mesh.positions[a][i] + mesh.positions[b][i]) / 2;
                mesh.positions.push_back(m);
            }
            return found->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
    }
    for (auto& p : mesh.positions) {
        const double norm = std::sqrt(double(p[0]) * p[0] + double(p[1]) * p[1] + double(p[2]) * p[2]);
        for (float& c : p) c = static_cast<float>(c * radius / norm);
    }
    return mesh;
}

// Triangles between random vertices: non-manifold, degenerate, duplicate, with isolated vertices.
inline Mesh soup(std::mt19937& random, std::size_t vertices, std::size_t triangles) {
    Mesh mesh;
    std::uniform_real_distribution<float> coordinate(-50, 50);
    for (std::size_t v = 0; v < vertices; ++v) {
        mesh.positions.push_back({coordinate(random), coordinate(random), coordinate(random)});
        mesh.colours.push_back({static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
                                static_cast<std::uint8_t>(random())});
    }
    for (std::size_t t = 0; t < triangles && vertices > 0; ++t) {
        Triangle corners;
        for (auto& v : corners) v = static_cast<std::uint32_t>(random() % vertices);
        mesh.triangles.push_back(corners);
    }
    return mesh;
}

inline Mesh moved(Mesh mesh, float x, float y, float z) {
    for (auto& p : mesh.positions) p = {p[0] + x, p[1] + y, p[2] + z};
    return mesh;
}

inline void append(Mesh& mesh, const Mesh& other) {
    const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({a + offset, b + offset, c + offset});
}

}  // namespace htvm::shapes
