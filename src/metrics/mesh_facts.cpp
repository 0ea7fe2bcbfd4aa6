#include "metrics/mesh_facts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/equal_floats.h"
#include "core/geometry.h"

namespace htvm {

using namespace internal;

namespace {

struct Box {
    std::array<double, 3> low, high;
    Box() {
        low.fill(std::numeric_limits<double>::max());
        high.fill(std::numeric_limits<double>::lowest());
    }
    void add(const Vector3f& p) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], static_cast<double>(p[c]));
            high[c] = std::max(high[c], static_cast<double>(p[c]));
        }
    }
    double diagonal() const { return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]); }
    // Between the two, 0 where they meet.
    double distance(const Box& other) const {
        std::array<double, 3> gap{};
        for (std::size_t c = 0; c < 3; ++c) gap[c] = std::max({0.0, low[c] - other.high[c], other.low[c] - high[c]});
        return std::hypot(gap[0], gap[1], gap[2]);
    }
};

struct Piece {
    double area = 0;
    Box box;
};

// Edges are counted by their ends.
void count_edges(const Mesh& mesh, const std::vector<Triangle>& triangles, MeshFacts& out) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(3 * triangles.size());
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(t[i], t[(i + 1) % 3]));
    std::sort(edges.begin(), edges.end());
    double length_sum = 0;
    std::size_t count = 0;
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        while (end < edges.size() && edges[end] == edges[begin]) ++end;
        const auto &a = mesh.positions[edges[begin].first], &b = mesh.positions[edges[begin].second];
        const double edge = std::hypot(static_cast<double>(a[0] - b[0]), static_cast<double>(a[1] - b[1]),
                                       static_cast<double>(a[2] - b[2]));
        length_sum += edge;
        ++count;
        if (end - begin == 1) out.border += edge;
        out.forked_edges += end - begin > 2;
    }
    out.mean_edge = count > 0 ? length_sum / static_cast<double>(count) : 0;
}

void find_pieces(const Mesh& mesh, const std::vector<Triangle>& triangles, MeshFacts& out) {
    DisjointSets sets(mesh.positions.size());
    for (const auto& t : triangles) {
        sets.join(t[0], t[1]);
        sets.join(t[1], t[2]);
    }
    std::unordered_map<std::uint32_t, Piece> pieces;
    std::array<double, 3> moment{};
    for (const auto& t : triangles) {
        auto& piece = pieces[sets.of(t[0])];
        const double area = length(area_vector(std::span(mesh.positions), t)) / 2;
        piece.area += area;
        for (const auto v : t) {
            piece.box.add(mesh.positions[v]);
            for (std::size_t c = 0; c < 3; ++c) moment[c] += area * static_cast<double>(mesh.positions[v][c]) / 3;
        }
        out.area += area;
    }
    out.pieces = pieces.size();
    if (pieces.empty()) return;
    for (std::size_t c = 0; c < 3 && out.area > 0; ++c) out.middle[c] = moment[c] / out.area;
    const auto& largest = std::max_element(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) {
                              return a.second.area < b.second.area;
                          })->second;
    for (const auto& [first, piece] : pieces) {
        out.specks += piece.area < 0.01 * largest.area;
        out.strays += piece.box.distance(largest.box) > 0.1 * largest.box.diagonal();
    }
    out.low = largest.box.low;
    out.high = largest.box.high;
}

// Weighted by area, as vertices lie closer in some frames than in others.
double light_of(const Mesh& mesh, const std::vector<Triangle>& triangles) {
    double sum = 0, all = 0;
    for (const auto& t : triangles) {
        const double area = length(area_vector(std::span(mesh.positions), t));
        for (const auto v : t)
            for (const auto level : mesh.colours[v]) sum += area * level / 9;
        all += area;
    }
    return all > 0 ? sum / all : 0;
}

}  // namespace

MeshFacts facts_of(const Mesh& mesh) {
    MeshFacts out;
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    const auto place = first_equal(std::span(mesh.positions));
    std::vector<bool> used(mesh.positions.size());
    std::vector<Triangle> triangles;
    for (const auto& t : mesh.triangles) {
        for (const auto v : t) used[v] = true;
        const Triangle at{place[t[0]], place[t[1]], place[t[2]]};
        const bool collapsed = at[0] == at[1] || at[1] == at[2] || at[2] == at[0];
        out.collapsed_triangles += collapsed;
        if (!collapsed) triangles.push_back(at);
    }
    out.unused_vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), false));
    count_edges(mesh, triangles, out);
    find_pieces(mesh, triangles, out);
    if (!mesh.colours.empty()) out.light = light_of(mesh, triangles);
    return out;
}

}  // namespace htvm
