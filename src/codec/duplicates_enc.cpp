#include "codec/duplicates_enc.h"

#include <bit>

namespace htvm {
namespace {

constexpr std::uint32_t none = 0xFFFFFFFFu;

bool same_vertex(const LatticeMesh& mesh, std::uint32_t a, std::uint32_t b) {
    return mesh.positions[a] == mesh.positions[b] && (mesh.colours.empty() || mesh.colours[a] == mesh.colours[b]) &&
           (mesh.normals.empty() || mesh.normals[a] == mesh.normals[b]) &&
           (mesh.texcoords.empty() || mesh.texcoords[a] == mesh.texcoords[b]);
}

std::uint64_t hash(LatticePoint p) {
    std::uint64_t h = static_cast<std::uint32_t>(p.x) * 0x9E3779B97F4A7C15ull;
    h = (h ^ (h >> 29) ^ static_cast<std::uint32_t>(p.y)) * 0xBF58476D1CE4E5B9ull;
    h = (h ^ (h >> 32) ^ static_cast<std::uint32_t>(p.z)) * 0x94D049BB133111EBull;
    return h ^ (h >> 31);
}

}  // namespace

Merging find_duplicates(const LatticeMesh& mesh) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    Merging out;
    out.number.resize(n);
    // Open addressing by position; vertices at one position form a chain, so that many attributes at one point do not
    // fill the table's neighbourhood.
    std::vector<std::uint32_t> table(std::bit_ceil(std::size_t{n} * 2 + 1), none);
    std::vector<std::uint32_t> next(n, none);
    for (std::uint32_t k = 0; k < n; ++k) {
        auto slot = hash(mesh.positions[k]) & (table.size() - 1);
        while (table[slot] != none && !(mesh.positions[table[slot]] == mesh.positions[k]))
            slot = (slot + 1) & (table.size() - 1);
        std::uint32_t same = table[slot];
        while (same != none && !same_vertex(mesh, same, k)) same = next[same];
        if (same != none) {
            out.number[k] = out.number[same];
            continue;
        }
        next[k] = table[slot];
        table[slot] = k;
        out.number[k] = static_cast<std::uint32_t>(out.kept.size());
        out.kept.push_back(k);
    }
    return out;
}

Merging no_duplicates(std::size_t vertices) {
    Merging out;
    for (std::uint32_t k = 0; k < vertices; ++k) out.kept.push_back(k);
    out.number = out.kept;
    return out;
}

std::vector<Triangle> merged_triangles(const std::vector<Triangle>& triangles, const Merging& merging,
                                       bool drop_collapsed) {
    std::vector<Triangle> out;
    out.reserve(triangles.size());
    for (const auto& t : triangles) {
        const Triangle m = {merging.number[t[0]], merging.number[t[1]], merging.number[t[2]]};
        if (drop_collapsed && (m[0] == m[1] || m[1] == m[2] || m[2] == m[0])) continue;
        out.push_back(m);
    }
    return out;
}

LatticeMesh kept_vertices(const LatticeMesh& mesh, const std::vector<std::uint32_t>& kept) {
    LatticeMesh out;
    for (const auto k : kept) {
        out.positions.push_back(mesh.positions[k]);
        if (!mesh.colours.empty()) out.colours.push_back(mesh.colours[k]);
        if (!mesh.normals.empty()) out.normals.push_back(mesh.normals[k]);
        if (!mesh.texcoords.empty()) out.texcoords.push_back(mesh.texcoords[k]);
    }
    return out;
}

}  // namespace htvm
