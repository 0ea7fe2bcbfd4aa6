#include "metrics/topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "metrics/mesh_measures.h"
#include "metrics/triangle_index.h"

namespace htvm {

using namespace internal;
namespace {

// A side of a triangle with three different vertices, directed from `from` to `to` as in the triangle.
struct Side {
    std::uint32_t low, high;  // the ends in order, so that equal edges are adjacent after sorting
    std::uint32_t from, triangle;
};

bool has_three_vertices(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

std::vector<Side> sorted_sides(const Mesh& mesh) {
    std::vector<Side> sides;
    sides.reserve(mesh.triangles.size() * 3);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& v = mesh.triangles[t];
        if (!has_three_vertices(v)) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(v[i], v[(i + 1) % 3]);
            sides.push_back({low, high, v[i], t});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.triangle, a.from) < std::tie(b.low, b.high, b.triangle, b.from);
    });
    return sides;
}

// Calls visit(first, count) for every edge, with the run of sides that belong to it.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
    for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
        while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
        visit(sides[i], end - i);
    }
}

Point3 corner(const Mesh& mesh, std::uint32_t triangle, std::size_t i) {
    return to_point(mesh.positions[mesh.triangles[triangle][i]]);
}

// Twice the area, along the normal.
Point3 area_normal(const Mesh& mesh, std::uint32_t t) {
    return internal::area_vector(std::span<const Vector3f>(mesh.positions), mesh.triangles[t]);
}

std::uint64_t count_duplicates(const Mesh& mesh) {
    std::vector<Triangle> sorted = mesh.triangles;
    for (auto& t : sorted) std::sort(t.begin(), t.end());
    std::sort(sorted.begin(), sorted.end());
    std::uint64_t duplicates = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) duplicates += sorted[i] == sorted[i - 1];
    return duplicates;
}

void count_parts(const Mesh& mesh, Topology& out) {
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    out.duplicate_triangles = count_duplicates(mesh);
    std::vector<bool> used(mesh.positions.size(), false);
    DisjointSets sets(mesh.positions.size());
    std::int64_t whole = 0;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& v = mesh.triangles[t];
        const Point3 n = area_normal(mesh, t);
        whole += has_three_vertices(v);
        out.degenerate_triangles += !has_three_vertices(v) || dot(n, n) == 0;
        for (std::uint32_t c : v) used[c] = true;
        sets.join(v[0], v[1]);
        sets.join(v[1], v[2]);
    }
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        out.isolated_vertices += !used[v];
        out.components += used[v] && sets.of(v) == v;
    }
    for_each_edge(sorted_sides(mesh), [&](const Side&, std::size_t triangles) {
        ++out.edges;
        out.boundary_edges += triangles == 1;
        out.non_manifold_edges += triangles > 2;
    });
    out.euler =
        static_cast<std::int64_t>(out.vertices - out.isolated_vertices) - static_cast<std::int64_t>(out.edges) + whole;
}

// The mesh with coincident vertices merged, without the triangles that then have a vertex twice.
Mesh welded(const Mesh& mesh) {
    const auto first = first_coincident_vertex(mesh);
    Mesh out;
    out.positions = mesh.positions;
    for (const auto& t : mesh.triangles) {
        const Triangle w{first[t[0]], first[t[1]], first[t[2]]};
        if (has_three_vertices(w)) out.triangles.push_back(w);
    }
    return out;
}

// The most candidates to examine around one triangle or edge, so that a heap of coincident surfaces does not take
// quadratic time.
constexpr int most_candidates = 200;

struct OpenEdge {
    std::uint32_t from, to;
    Point3 outward;  // in the plane of the triangle, pointing away from it
};

std::vector<OpenEdge> open_edges(const Mesh& mesh) {
    std::vector<OpenEdge> edges;
    for_each_edge(sorted_sides(mesh), [&](const Side& side, std::size_t triangles) {
        if (triangles != 1) return;
        const std::uint32_t to = side.from == side.low ? side.high : side.low;
        const Point3 along = to_point(mesh.positions[to]) - to_point(mesh.positions[side.from]);
        edges.push_back({side.from, to, normalised(cross(along, area_normal(mesh, side.triangle)))});
    });
    return edges;
}

// For an item without a counterpart across a crack or a flap.
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// The nearest counterpart so far; of equally near ones, the lowest index.
struct Counterpart {
    std::uint32_t index = none;
    double distance = 0;
    void offer(std::uint32_t candidate, double candidate_distance) {
        const bool better =
            index == none || candidate_distance < distance || (candidate_distance == distance && candidate < index);
        if (better) index = candidate, distance = candidate_distance;
    }
};

// The number of groups formed by the items that have a counterpart: items that share a vertex, or are counterparts,
// belong to the same group. vertices_of(i) is an array of the vertices of item i.
template <class VerticesOf>
std::uint64_t count_groups(std::size_t vertices, const std::vector<std::uint32_t>& counterparts,
                           const VerticesOf& vertices_of) {
    DisjointSets sets(vertices);
    std::vector<std::uint32_t> roots;
    for (std::uint32_t i = 0; i < counterparts.size(); ++i) {
        if (counterparts[i] == none) continue;
        const auto own = vertices_of(i);
        for (std::uint32_t v : own) sets.join(own[0], v);
        for (std::uint32_t v : vertices_of(counterparts[i])) sets.join(own[0], v);
        roots.push_back(own[0]);
    }
    for (auto& root : roots) root = sets.of(root);
    std::sort(roots.begin(), roots.end());
    return static_cast<std::uint64_t>(std::unique(roots.begin(), roots.end()) - roots.begin());
}

std::uint32_t across_the_crack(const Mesh& lines, const OpenEdge& edge, std::uint32_t e, const TriangleIndex& index,
                               double width) {
    const Point3 a = corner(lines, e, 0), b = corner(lines, e, 1);
    const Point3 middle = (a + b) * 0.5, along = normalised(b - a);
    Counterpart best;
    int candidates = 0;
    index.visit_near(middle, width, [&](std::uint32_t f) {
        if (f == e) return true;
        const Point3 c = corner(lines, f, 0), d = corner(lines, f, 1);
        const Point3 gap = closest_point_of(middle, c, d, d) - middle;
        const bool outside = dot(gap, edge.outward) >= -1e-6 * width;
        if (length(gap) <= width && outside && dot(along, normalised(d - c)) < -std::sqrt(0.5))
            best.offer(f, length(gap));
        return ++candidates < most_candidates;
    });
    return best.index;
}

Result<void> find_cracks(const Mesh& mesh, double width, Threads threads, Topology& out) {
    const auto edges = open_edges(mesh);
    out.open_edges = edges.size();
    if (edges.empty()) return {};
    Mesh lines;  // the open edges, as triangles without area in the same order
    lines.positions = mesh.positions;
    for (const auto& e : edges) lines.triangles.push_back({e.from, e.to, e.to});
    const auto index = TriangleIndex::build(lines, threads);
    if (!index) return tl::unexpected(index.error());
    std::vector<std::uint32_t> across(edges.size(), none);
    parallel_for(edges.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e)
            across[e] = across_the_crack(lines, edges[e], static_cast<std::uint32_t>(e), *index, width);
    });
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
        if (across[e] == none) continue;
        ++out.crack_edges;
        out.crack_length += length(corner(lines, e, 1) - corner(lines, e, 0)) / 2;
    }
    out.cracks = count_groups(mesh.positions.size(), across, [&](std::uint32_t e) {
        return std::array<std::uint32_t, 2>{edges[e].from, edges[e].to};
    });
    return {};
}

bool share_a_vertex(const Triangle& a, const Triangle& b) {
    for (std::uint32_t v : a)
        if (v == b[0] || v == b[1] || v == b[2]) return true;
    return false;
}

std::uint32_t other_layer(const Mesh& mesh, const TriangleIndex& index, std::uint32_t t, double distance) {
    const Point3 normal = normalised(area_normal(mesh, t));
    if (dot(normal, normal) == 0) return none;
    const Point3 centre = (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) * (1.0 / 3);
    Counterpart best;
    int candidates = 0;
    index.visit_near(centre, distance, [&](std::uint32_t u) {
        if (share_a_vertex(mesh.triangles[t], mesh.triangles[u])) return true;
        const Point3 gap =
            closest_point_of(centre, corner(mesh, u, 0), corner(mesh, u, 1), corner(mesh, u, 2)) - centre;
        const bool steep = std::abs(dot(gap, normal)) >= std::sqrt(0.5) * length(gap);
        const bool same_way = dot(normal, normalised(area_normal(mesh, u))) >= std::sqrt(0.5);
        if (length(gap) <= distance && steep && same_way) best.offer(u, length(gap));
        return ++candidates < most_candidates;
    });
    return best.index;
}

Result<void> find_flaps(const Mesh& mesh, double distance, Threads threads, Topology& out) {
    if (mesh.triangles.empty()) return {};
    const auto index = TriangleIndex::build(mesh, threads);
    if (!index) return tl::unexpected(index.error());
    std::vector<std::uint32_t> other(mesh.triangles.size(), none);
    parallel_for(mesh.triangles.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t)
            other[t] = other_layer(mesh, *index, static_cast<std::uint32_t>(t), distance);
    });
    for (std::uint32_t t = 0; t < other.size(); ++t) {
        if (other[t] == none) continue;
        ++out.flap_triangles;
        out.flap_area += length(area_normal(mesh, t)) / 2;
    }
    out.flaps = count_groups(mesh.positions.size(), other, [&](std::uint32_t t) { return mesh.triangles[t]; });
    return {};
}

}  // namespace

Result<Topology> topology(const Mesh& mesh, const TopologyMeasureOptions& options, Threads threads) {
    Topology out;
    count_parts(mesh, out);
    if (!options.defects) return out;
    const Mesh surface = welded(mesh);
    const double half_edge = internal::mean_edge(surface.positions, surface.triangles) / 2;
    const double width = options.crack_width > 0 ? options.crack_width : half_edge;
    const double distance = options.flap_distance > 0 ? options.flap_distance : half_edge;
    if (const auto done = find_cracks(surface, width, threads, out); !done) return tl::unexpected(done.error());
    if (const auto done = find_flaps(surface, distance, threads, out); !done) return tl::unexpected(done.error());
    return out;
}

}  // namespace htvm
