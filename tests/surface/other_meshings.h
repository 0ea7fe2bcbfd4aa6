// Meshes of nearly the same surface that are connected, or numbered, otherwise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm::test {

// Turns one edge in so many between two triangles into the other diagonal of the two, where they are about flat
// there; which edges depends on `seed`.
inline void flip_edges(Mesh& mesh, std::uint32_t one_in, std::uint32_t seed) {
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::map<Edge, std::size_t> left_of;  // the triangle on the left of a directed edge
    const auto enter = [&](std::size_t t) {
        const auto& [a, b, c] = mesh.triangles[t];
        left_of[{a, b}] = left_of[{b, c}] = left_of[{c, a}] = t;
    };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) enter(t);
    const auto opposite = [&](std::size_t t, std::uint32_t a, std::uint32_t b) {
        const auto& corners = mesh.triangles[t];
        return *std::find_if(corners.begin(), corners.end(), [&](std::uint32_t v) { return v != a && v != b; });
    };
    const auto normal = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        std::array<float, 3> u{}, v{};
        for (std::size_t i = 0; i < 3; ++i) {
            u[i] = mesh.positions[b][i] - mesh.positions[a][i];
            v[i] = mesh.positions[c][i] - mesh.positions[a][i];
        }
        return std::array{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    };
    const auto agree = [](const std::array<float, 3>& m, const std::array<float, 3>& n) {
        const auto dot = [](const auto& u, const auto& v) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; };
        return dot(m, n) > 0.98F * std::sqrt(dot(m, m) * dot(n, n));
    };
    std::vector<std::uint8_t> touched(mesh.triangles.size(), 0);
    std::mt19937 random(seed);
    const auto edges = left_of;
    for (const auto& [edge, t] : edges) {
        const auto [a, b] = edge;
        const auto other = edges.find({b, a});
        if (a > b || other == edges.end() || random() % one_in != 0) continue;
        const auto u = other->second;
        if (touched[t] || touched[u]) continue;
        const auto c = opposite(t, a, b), d = opposite(u, a, b);
        const auto now = normal(a, b, c), beside = normal(b, a, d);
        if (left_of.contains({c, d}) || left_of.contains({d, c}) || !agree(now, beside) ||
            !agree(now, normal(a, d, c)) || !agree(now, normal(d, b, c)))
            continue;
        mesh.triangles[t] = {a, d, c};
        mesh.triangles[u] = {d, b, c};
        touched[t] = touched[u] = 1;
        enter(t), enter(u);
    }
}

// The same mesh with its vertices and triangles numbered from another one on, by so many places.
inline Mesh renumbered(Mesh mesh, std::size_t places) {
    const std::size_t vertices = mesh.positions.size();
    const auto turn = [places](auto& values) {
        if (!values.empty())
            std::rotate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(places % values.size()),
                        values.end());
    };
    turn(mesh.positions), turn(mesh.normals), turn(mesh.colours), turn(mesh.texcoords), turn(mesh.triangles);
    for (auto& triangle : mesh.triangles)
        for (auto& v : triangle) v = static_cast<std::uint32_t>((v + vertices - places % vertices) % vertices);
    return mesh;
}

}  // namespace htvm::test
