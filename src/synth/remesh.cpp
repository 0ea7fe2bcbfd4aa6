#include "synth/remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/disjoint_sets.h"
#include "core/parallel.h"

namespace htvm::synth {

using namespace internal;
namespace {

using Eigen::Vector3d;

std::uint32_t next(std::uint32_t e) { return e % 3 == 2 ? e - 2 : e + 1; }
std::uint32_t previous(std::uint32_t e) { return e % 3 == 0 ? e + 2 : e - 1; }

std::uint32_t target(const HalfEdgeMesh& mesh, std::uint32_t e) { return mesh.origin[next(e)]; }

// The next half-edge that leaves the same vertex.
std::uint32_t rotate(const HalfEdgeMesh& mesh, std::uint32_t e) { return mesh.twin[previous(e)]; }

template <class Visit>
void for_each_outgoing(const HalfEdgeMesh& mesh, std::uint32_t vertex, const Visit& visit) {
    const std::uint32_t first = mesh.outgoing[vertex];
    std::uint32_t e = first;
    do {
        visit(e);
        e = rotate(mesh, e);
    } while (e != first);
}

bool adjacent(const HalfEdgeMesh& mesh, std::uint32_t a, std::uint32_t b) {
    bool found = false;
    for_each_outgoing(mesh, a, [&](std::uint32_t e) { found |= target(mesh, e) == b; });
    return found;
}

Vector3d area_vector(const Vector3d& a, const Vector3d& b, const Vector3d& c) { return (b - a).cross(c - a); }

// Keeps the triangles of components that have at least `fewest` triangles.
std::vector<Triangle> large_components(std::size_t vertices, const std::vector<Triangle>& triangles,
                                       std::size_t fewest) {
    DisjointSets components(vertices);
    for (const auto& t : triangles) {
        components.join(t[0], t[1]);
        components.join(t[0], t[2]);
    }
    std::vector<std::size_t> size(vertices, 0);
    for (const auto& t : triangles) ++size[components.of(t[0])];
    std::vector<Triangle> kept;
    kept.reserve(triangles.size());
    for (const auto& t : triangles)
        if (size[components.of(t[0])] >= fewest) kept.push_back(t);
    return kept;
}

// Pairs half-edges by sorting those of each vertex into buckets; false if one has no partner or several.
bool pair_half_edges(HalfEdgeMesh& mesh) {
    const std::size_t vertices = mesh.positions.size(), count = mesh.origin.size();
    std::vector<std::uint32_t> start(vertices + 1, 0), bucket(count);
    for (const auto v : mesh.origin) ++start[v + 1];
    for (std::size_t v = 0; v < vertices; ++v) start[v + 1] += start[v];
    auto fill = start;
    for (std::uint32_t e = 0; e < count; ++e) bucket[fill[mesh.origin[e]]++] = e;
    mesh.twin.assign(count, dead_half_edge);
    mesh.outgoing.assign(vertices, dead_half_edge);
    mesh.valence.assign(vertices, 0);
    for (std::uint32_t e = 0; e < count; ++e) {
        const std::uint32_t from = mesh.origin[e], to = target(mesh, e);
        mesh.outgoing[from] = e;
        ++mesh.valence[from];
        for (std::uint32_t i = start[to]; i < start[to + 1]; ++i) {
            if (target(mesh, bucket[i]) != from) continue;
            if (mesh.twin[e] != dead_half_edge) return false;
            mesh.twin[e] = bucket[i];
        }
        if (mesh.twin[e] == dead_half_edge) return false;
    }
    for (std::uint32_t v = 0; v < vertices; ++v) {
        if (mesh.outgoing[v] == dead_half_edge) continue;
        std::uint32_t round = 0;
        for_each_outgoing(mesh, v, [&](std::uint32_t) { ++round; });
        if (round != mesh.valence[v]) return false;  // several fans meet in this vertex
    }
    return true;
}

// Like would_fold, without the triangles that contain `other`.
bool would_fold_without(const HalfEdgeMesh& mesh, std::uint32_t vertex, std::uint32_t other, const Vector3d& place) {
    bool folds = false;
    for_each_outgoing(mesh, vertex, [&](std::uint32_t e) {
        const std::uint32_t a = target(mesh, e), b = mesh.origin[previous(e)];
        if (a == other || b == other) return;
        const Vector3d &pa = mesh.positions[a], &pb = mesh.positions[b];
        const Vector3d before = area_vector(mesh.positions[vertex], pa, pb), after = area_vector(place, pa, pb);
        folds |= before.dot(after) < 0.3 * before.norm() * after.norm();
    });
    return folds;
}

// The two ends may have no common neighbours except the two opposite to the edge.
bool link_is_clean(const HalfEdgeMesh& mesh, std::uint32_t u, std::uint32_t v) {
    int common = 0;
    for_each_outgoing(mesh, u, [&](std::uint32_t e) { common += adjacent(mesh, v, target(mesh, e)) ? 1 : 0; });
    return common == 2;
}

bool collapse_edge(HalfEdgeMesh& mesh, std::uint32_t e) {
    const std::uint32_t t = mesh.twin[e];
    const std::uint32_t u = mesh.origin[e], v = mesh.origin[t];
    const std::uint32_t w = mesh.origin[previous(e)], x = mesh.origin[previous(t)];
    constexpr std::uint32_t largest_valence = 9;
    if (mesh.valence[w] <= 3 || mesh.valence[x] <= 3 || mesh.valence[u] + mesh.valence[v] - 4 > largest_valence)
        return false;
    if (!link_is_clean(mesh, u, v)) return false;
    const Vector3d middle = 0.5 * (mesh.positions[u] + mesh.positions[v]);
    if (would_fold_without(mesh, u, v, middle) || would_fold_without(mesh, v, u, middle)) return false;

    const std::uint32_t a = mesh.twin[next(e)], b = mesh.twin[previous(e)];
    const std::uint32_t c = mesh.twin[next(t)], d = mesh.twin[previous(t)];
    const std::uint32_t first = mesh.outgoing[u];
    for (std::uint32_t h = first;;) {
        const std::uint32_t following = rotate(mesh, h);
        mesh.origin[h] = v;
        h = following;
        if (h == first) break;
    }
    mesh.twin[a] = b;
    mesh.twin[b] = a;
    mesh.twin[c] = d;
    mesh.twin[d] = c;
    for (const std::uint32_t dead : {e, next(e), previous(e), t, next(t), previous(t)})
        mesh.origin[dead] = dead_half_edge;
    mesh.valence[v] += mesh.valence[u] - 4;
    --mesh.valence[w];
    --mesh.valence[x];
    mesh.outgoing[v] = b;
    mesh.outgoing[w] = a;
    mesh.outgoing[x] = c;
    mesh.outgoing[u] = dead_half_edge;
    mesh.valence[u] = 0;
    mesh.positions[v] = middle;
    return true;
}

// The cotangent of the angle opposite to a half-edge in its triangle.
double facing_cotangent(const HalfEdgeMesh& mesh, std::uint32_t e) {
    const Vector3d apex = mesh.positions[mesh.origin[previous(e)]];
    const Vector3d a = mesh.positions[mesh.origin[e]] - apex, b = mesh.positions[target(mesh, e)] - apex;
    return a.dot(b) / std::max(a.cross(b).norm(), 1e-12);
}

bool flip_edge(HalfEdgeMesh& mesh, std::uint32_t e) {
    const std::uint32_t t = mesh.twin[e], en = next(e), ep = previous(e), tn = next(t), tp = previous(t);
    const std::uint32_t u = mesh.origin[e], v = mesh.origin[t], w = mesh.origin[ep], x = mesh.origin[tp];
    if (mesh.valence[u] <= 3 || mesh.valence[v] <= 3 || adjacent(mesh, w, x)) return false;
    const auto& p = mesh.positions;
    const Vector3d old_one = area_vector(p[u], p[v], p[w]), old_two = area_vector(p[v], p[u], p[x]);
    const Vector3d new_one = area_vector(p[w], p[x], p[v]), new_two = area_vector(p[x], p[w], p[u]);
    const Vector3d mean = old_one + old_two;
    const auto aligned = [](const Vector3d& a, const Vector3d& b, double least) {
        return a.dot(b) > least * a.norm() * b.norm();
    };
    if (!aligned(old_one, old_two, 0.6) || !aligned(new_one, mean, 0.5) || !aligned(new_two, mean, 0.5)) return false;

    // e: w -> x, opposite to v; t: x -> w, opposite to u. The four outer half-edges move between the triangles.
    const std::uint32_t outer_vw = mesh.twin[en], outer_wu = mesh.twin[ep], outer_ux = mesh.twin[tn],
                        outer_xv = mesh.twin[tp];
    const auto link = [&](std::uint32_t h, std::uint32_t from, std::uint32_t outer) {
        mesh.origin[h] = from;
        mesh.twin[h] = outer;
        mesh.twin[outer] = h;
        mesh.outgoing[from] = h;
    };
    mesh.origin[e] = w;
    mesh.origin[t] = x;
    link(en, x, outer_xv);
    link(ep, v, outer_vw);
    link(tn, w, outer_wu);
    link(tp, u, outer_ux);
    --mesh.valence[u];
    --mesh.valence[v];
    ++mesh.valence[w];
    ++mesh.valence[x];
    return true;
}

}  // namespace

HalfEdgeMesh build_half_edges(const std::vector<Vector3d>& positions, const std::vector<Triangle>& triangles,
                              std::size_t fewest) {
    HalfEdgeMesh mesh;
    mesh.positions = positions;
    const auto kept = large_components(positions.size(), triangles, fewest);
    mesh.origin.reserve(3 * kept.size());
    for (const auto& t : kept) mesh.origin.insert(mesh.origin.end(), t.begin(), t.end());
    if (!pair_half_edges(mesh)) return {};
    return mesh;
}

bool would_fold(const HalfEdgeMesh& mesh, std::uint32_t vertex, const Vector3d& place) {
    return would_fold_without(mesh, vertex, dead_half_edge, place);
}

void collapse_to(HalfEdgeMesh& mesh, std::size_t vertices) {
    const auto is_alive = [](std::uint32_t e) { return e != dead_half_edge; };
    auto alive = static_cast<std::size_t>(std::ranges::count_if(mesh.outgoing, is_alive));
    std::vector<std::pair<double, std::uint32_t>> edges;
    std::vector<bool> touched;
    constexpr int most_rounds = 60;
    for (int round = 0; round < most_rounds && alive > vertices; ++round) {
        edges.clear();
        for (std::uint32_t e = 0; e < mesh.origin.size(); ++e)
            if (mesh.origin[e] != dead_half_edge && e < mesh.twin[e])
                edges.emplace_back((mesh.positions[mesh.origin[e]] - mesh.positions[target(mesh, e)]).squaredNorm(), e);
        // Only the shortest third per round, since collapses lengthen the edges around them.
        const auto end = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 3);
        std::nth_element(edges.begin(), end, edges.end());
        std::sort(edges.begin(), end);
        touched.assign(mesh.positions.size(), false);
        const std::size_t before = alive;
        for (auto edge = edges.begin(); edge != end && alive > vertices; ++edge) {
            const std::uint32_t e = edge->second;
            if (mesh.origin[e] == dead_half_edge) continue;
            const std::uint32_t u = mesh.origin[e], v = target(mesh, e);
            if (touched[u] || touched[v] || !collapse_edge(mesh, e)) continue;
            touched[v] = true;
            --alive;
        }
        if (alive == before) break;
    }
}

void flip_to_delaunay(HalfEdgeMesh& mesh) {
    constexpr int most_passes = 4;
    for (int pass = 0; pass < most_passes; ++pass) {
        bool flipped = false;
        for (std::uint32_t e = 0; e < mesh.origin.size(); ++e) {
            if (mesh.origin[e] == dead_half_edge || mesh.twin[e] < e) continue;
            if (facing_cotangent(mesh, e) + facing_cotangent(mesh, mesh.twin[e]) < -1e-9) flipped |= flip_edge(mesh, e);
        }
        if (!flipped) return;
    }
}

std::vector<Vector3d> vertex_normals(const HalfEdgeMesh& mesh, Threads threads) {
    std::vector<Vector3d> normals(mesh.positions.size(), Vector3d::Zero());
    parallel_for(normals.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            if (mesh.outgoing[v] == dead_half_edge) continue;
            for_each_outgoing(mesh, static_cast<std::uint32_t>(v), [&](std::uint32_t e) {
                normals[v] += area_vector(mesh.positions[v], mesh.positions[target(mesh, e)],
                                          mesh.positions[mesh.origin[previous(e)]]);
            });
            normals[v] /= std::max(normals[v].norm(), 1e-12);
        }
    });
    return normals;
}

void relax(HalfEdgeMesh& mesh, double share, Threads threads) {
    const auto normals = vertex_normals(mesh, threads);
    std::vector<Vector3d> moved = mesh.positions;
    parallel_for(moved.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            if (mesh.outgoing[v] == dead_half_edge) continue;
            Vector3d mean = Vector3d::Zero();
            for_each_outgoing(mesh, static_cast<std::uint32_t>(v),
                              [&](std::uint32_t e) { mean += mesh.positions[target(mesh, e)]; });
            const Vector3d step = mean / mesh.valence[v] - mesh.positions[v];
            moved[v] += share * (step - step.dot(normals[v]) * normals[v]);
        }
    });
    mesh.positions = std::move(moved);
}

void compact(HalfEdgeMesh& mesh) {
    std::vector<std::uint32_t> vertex_name(mesh.positions.size(), dead_half_edge), edge_name(mesh.origin.size());
    HalfEdgeMesh result;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        if (mesh.outgoing[v] == dead_half_edge) continue;
        vertex_name[v] = static_cast<std::uint32_t>(result.positions.size());
        result.positions.push_back(mesh.positions[v]);
        result.valence.push_back(mesh.valence[v]);
    }
    std::uint32_t edges = 0;
    for (std::size_t e = 0; e < mesh.origin.size(); ++e)
        if (mesh.origin[e] != dead_half_edge) edge_name[e] = edges++;
    for (std::size_t e = 0; e < mesh.origin.size(); ++e) {
        if (mesh.origin[e] == dead_half_edge) continue;
        result.origin.push_back(vertex_name[mesh.origin[e]]);
        result.twin.push_back(edge_name[mesh.twin[e]]);
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        if (mesh.outgoing[v] != dead_half_edge) result.outgoing.push_back(edge_name[mesh.outgoing[v]]);
    mesh = std::move(result);
}

std::vector<Triangle> triangles_of(const HalfEdgeMesh& mesh) {
    std::vector<Triangle> triangles(mesh.origin.size() / 3);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        triangles[t] = {mesh.origin[3 * t], mesh.origin[3 * t + 1], mesh.origin[3 * t + 2]};
    return triangles;
}

}  // namespace htvm::synth
