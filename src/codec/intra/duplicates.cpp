#include "codec/intra/duplicates.h"

#include <bit>

namespace htvm::internal {
namespace {

constexpr std::uint32_t none = 0xFFFFFFFFu;

bool same_vertex(const LatticeMesh& mesh, std::uint32_t a, std::uint32_t b) {
    return mesh.positions[a] == mesh.positions[b] && (mesh.colours.empty() || mesh.colours[a] == mesh.colours[b]) &&
           (mesh.normals.empty() || mesh.normals[a] == mesh.normals[b]) &&
           (mesh.texcoords.empty() || mesh.texcoords[a] == mesh.texcoords[b]);
}

std::uint64_t mixed(std::uint64_t h, std::uint32_t value) {
    h = (h ^ value) * 0x9E3779B97F4A7C15ull;
    return h ^ (h >> 29);
}

// Hashes position and attributes, so that many different vertices at one point do not collide.
std::uint64_t hash(const LatticeMesh& mesh, std::uint32_t k) {
    const auto& p = mesh.positions[k];
    std::uint64_t h = 1;
    for (const auto c : {p.x, p.y, p.z}) h = mixed(h, static_cast<std::uint32_t>(c));
    if (!mesh.colours.empty()) {
        const auto& c = mesh.colours[k];
        h = mixed(h, std::uint32_t{c[0]} | std::uint32_t{c[1]} << 8 | std::uint32_t{c[2]} << 16);
    }
    if (!mesh.normals.empty())
        for (const auto c : mesh.normals[k]) h = mixed(h, static_cast<std::uint32_t>(c));
    if (!mesh.texcoords.empty())
        for (const auto c : mesh.texcoords[k]) h = mixed(h, static_cast<std::uint32_t>(c));
    return h ^ (h >> 32);
}

}  // namespace

Merging find_duplicates(const LatticeMesh& mesh) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    Merging out;
    out.number.resize(n);
    // A hash table with open addressing.
    std::vector<std::uint32_t> table(std::bit_ceil(std::size_t{n} * 2 + 1), none);
    for (std::uint32_t k = 0; k < n; ++k) {
        auto slot = hash(mesh, k) & (table.size() - 1);
        while (table[slot] != none && !same_vertex(mesh, table[slot], k)) slot = (slot + 1) & (table.size() - 1);
        if (table[slot] != none) {
            out.number[k] = out.number[table[slot]];
            continue;
        }
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

Merging at_same_place(const LatticeMesh& captured) {
    LatticeMesh places;
    places.positions = captured.positions;
    return find_duplicates(places);
}

LatticeMesh welded(const LatticeMesh& captured, const Merging& same_place) {
    auto out = kept_vertices(captured, same_place.kept);
    out.triangles = merged_triangles(captured.triangles, same_place, false);
    return out;
}

}  // namespace htvm::internal
