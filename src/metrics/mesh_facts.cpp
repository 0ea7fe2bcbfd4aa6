#include "metrics/mesh_facts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/geometry.h"

namespace htvm {

using namespace internal;

namespace {

struct PlaceHash {
    std::size_t operator()(const Vector3f& p) const {
        std::uint64_t h = 0;
        for (const float c : p) h = (h ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0x9e3779b97f4a7c15u;
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

// The first vertex at the place of each.
std::vector<std::uint32_t> places_of(const Mesh& mesh) {
    std::unordered_map<Vector3f, std::uint32_t, PlaceHash> known;
    known.reserve(mesh.positions.size());
    std::vector<std::uint32_t> out;
    out.reserve(mesh.positions.size());
    for (const auto& p : mesh.positions)
        out.push_back(known.emplace(p, static_cast<std::uint32_t>(out.size())).first->second);
    return out;
}

// Sets that are joined one pair after another.
class JoinedSets {
public:
    explicit JoinedSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
    std::uint32_t of(std::uint32_t a) {
        while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
        return a;
    }
    void join(std::uint32_t a, std::uint32_t b) { parent_[of(a)] = of(b); }

private:
    std::vector<std::uint32_t> parent_;
};

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
    JoinedSets sets(mesh.positions.size());
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

}  // namespace

MeshFacts facts_of(const Mesh& mesh) {
    MeshFacts out;
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    const auto place = places_of(mesh);
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
    if (!mesh.colours.empty()) {
        double sum = 0;
        for (const auto& colour : mesh.colours) sum += colour[0] + colour[1] + colour[2];
        out.light = sum / (3.0 * static_cast<double>(mesh.colours.size()));
    }
    return out;
}

}  // namespace htvm
