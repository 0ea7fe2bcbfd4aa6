#include "codec/reference/surface_detail.h"

#include <algorithm>
#include <array>

#include "core/lattice.h"

namespace htvm::internal {
namespace {

template <class Value, class Mean>
void add_means(const SurfaceDetail& detail, std::size_t shown, std::vector<Value>& values, const Mean& mean) {
    if (values.empty()) return;
    for (std::size_t k = 0; k < shown; ++k)
        for (const auto& s : detail.levels[k].stencils) {
            const Value between = mean(values[s.a], values[s.b]);
            values.push_back(between);
        }
}

}  // namespace

void add_detail(const SurfaceDetail& detail, std::size_t shown, std::span<const Triangle> triangles,
                std::vector<LatticePoint>& positions, Threads threads) {
    const std::size_t of_reference = positions.size();
    for (std::size_t k = 0; k < shown; ++k) {
        const auto& level = detail.levels[k];
        const auto displacements =
            std::span(detail.displacements).subspan(positions.size() - of_reference, level.stencils.size());
        add_vertices(level, detail.rules[k], k == 0 ? triangles : detail.triangles(k), displacements, positions,
                     threads);
    }
}

Colour off_mean(const Colour& a, const Colour& b, const std::array<std::int32_t, 3>& more) {
    Colour out;
    for (std::size_t c = 0; c < 3; ++c)
        out[c] = static_cast<std::uint8_t>(std::clamp((a[c] + b[c] + 1) / 2 + more[c], 0, 255));
    return out;
}

void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<Colour>& colours) {
    if (colours.empty()) return;
    std::size_t i = 0;
    for (std::size_t k = 0; k < shown; ++k)
        for (const auto& s : detail.levels[k].stencils) {
            const Colour own = off_mean(colours[s.a], colours[s.b],
                                        i < detail.colours.size() ? detail.colours[i] : std::array<std::int32_t, 3>{});
            colours.push_back(own);
            ++i;
        }
}

void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<QuantisedNormal>& normals) {
    // Halves are away from zero, so that a mirrored surface has mirrored normals.
    add_means(detail, shown, normals, [](const QuantisedNormal& a, const QuantisedNormal& b) {
        QuantisedNormal out;
        for (std::size_t c = 0; c < out.size(); ++c) out[c] = static_cast<std::int32_t>(divide_rounded(a[c] + b[c], 2));
        return out;
    });
}

void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<std::uint8_t>& presence) {
    add_means(detail, shown, presence, [](std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a & b); });
}

LatticeMesh detailed(const SurfaceDetail& detail, LatticeMesh mesh) {
    if (detail.empty()) return mesh;
    const auto all = detail.levels.size();
    add_detail(detail, all, mesh.triangles, mesh.positions);
    add_detail(detail, all, mesh.colours);
    add_detail(detail, all, mesh.normals);
    mesh.triangles = detail.triangles(all);
    return mesh;
}

SurfaceDetail detail_that_stays(const SurfaceDetail& before, std::size_t vertices_before,
                                std::span<const std::uint32_t> stays, const LatticeMesh& patched) {
    SurfaceDetail out;
    // The new number of each vertex before, of all levels so far.
    std::vector<std::uint32_t> number(vertices_before + before.vertices(), no_element);
    for (std::uint32_t v = 0; v < stays.size(); ++v) number[stays[v]] = v;
    auto places = places_of(patched.positions);
    auto edges = before.empty() ? MeshEdges{} : find_edges(places.size(), patched.triangles);
    // Splits that stay, by their ends.
    struct Split {
        std::array<std::uint32_t, 2> ends;
        std::uint32_t vertex;     // before
        std::uint32_t taken = 0;  // of the first with these ends: how many of them are taken over
    };
    std::vector<Split> splits;
    for (std::size_t k = 0; k < before.levels.size(); ++k) {
        const auto& level = before.levels[k];
        splits.clear();
        for (std::uint32_t i = 0; i < level.stencils.size(); ++i) {
            const auto a = number[level.stencils[i].a], b = number[level.stencils[i].b];
            if (a == no_element || b == no_element) continue;
            splits.push_back({{std::min(a, b), std::max(a, b)}, level.first + i});
        }
        std::sort(splits.begin(), splits.end(), [](const Split& x, const Split& y) {
            return x.ends != y.ends ? x.ends < y.ends : x.vertex < y.vertex;
        });
        std::vector<std::uint8_t> is_split(edges.size(), 0);
        std::vector<double> displacements;
        std::vector<std::array<std::int32_t, 3>> colours;
        for (std::size_t e = 0; e < edges.size(); ++e) {
            auto found = std::lower_bound(splits.begin(), splits.end(), edges.ends[e],
                                          [](const Split& s, const auto& ends) { return s.ends < ends; });
            // Those that are taken stay in front of the others with the same ends, and say how many they are.
            if (found == splits.end() || found->ends != edges.ends[e]) continue;
            const auto first = found;
            found += static_cast<std::ptrdiff_t>(first->taken);
            if (found == splits.end() || found->ends != edges.ends[e]) continue;
            ++first->taken;
            is_split[e] = 1;
            number[found->vertex] = static_cast<std::uint32_t>(places.size() + displacements.size());
            const std::size_t own = found->vertex - vertices_before;
            displacements.push_back(before.displacements[own]);
            if (own < before.colours.size()) colours.push_back(before.colours[own]);
        }
        MeshEdges next;
        const auto& triangles = k == 0 ? patched.triangles : out.levels.back().triangles;
        auto split =
            split_edges(places, triangles, edges, is_split, patched.positions.size() + before.vertices(), &next);
        if (!split) break;
        add_middles(*split, places);
        edges = std::move(next);
        out.levels.push_back(std::move(*split));
        out.rules.push_back(before.rules[k]);
        out.displacements.insert(out.displacements.end(), displacements.begin(), displacements.end());
        out.colours.insert(out.colours.end(), colours.begin(), colours.end());
    }
    if (out.displacements.empty()) return {};
    return out;
}

}  // namespace htvm::internal
