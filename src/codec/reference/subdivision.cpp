#include "codec/reference/subdivision.h"

#include <algorithm>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

struct Side {
    std::uint32_t low, high, corner;  // corner: three times the triangle and where in it the side begins
};

// Sides sorted by low, then high, then corner: a counting sort by each vertex, the minor one first.
std::vector<Side> sorted_sides(std::size_t vertices, std::span<const Triangle> triangles) {
    std::vector<Side> sides, sorted;
    sides.reserve(3 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        if (a == b || b == c || a == c) continue;
        for (std::uint32_t i = 0; i < 3; ++i) {
            const std::uint32_t from = triangles[t][i], to = triangles[t][(i + 1) % 3];
            sides.push_back({std::min(from, to), std::max(from, to), 3 * t + i});
        }
    }
    sorted.resize(sides.size());
    std::vector<std::uint32_t> first(vertices + 1);
    for (const auto key : {&Side::high, &Side::low}) {
        std::fill(first.begin(), first.end(), 0);
        for (const auto& side : sides) ++first[side.*key + std::size_t{1}];
        for (std::size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
        for (const auto& side : sides) sorted[first[side.*key]++] = side;
        sides.swap(sorted);
    }
    return sides;
}

std::uint32_t third_corner(const Triangle& triangle, std::uint32_t a, std::uint32_t b) {
    for (const auto v : triangle)
        if (v != a && v != b) return v;
    return no_element;
}

// The two borders that meet at each vertex, as edges; no_element where more or fewer do.
std::vector<std::array<std::uint32_t, 2>> borders_at(std::size_t vertices, const MeshEdges& edges) {
    std::vector<std::array<std::uint32_t, 2>> out(vertices, {no_element, no_element});
    std::vector<std::uint8_t> count(vertices, 0);
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
        if (edges.sides[e] != 1) continue;
        for (const auto v : edges.ends[e]) {
            if (count[v] < 2) out[v][count[v]] = e;
            count[v] = static_cast<std::uint8_t>(std::min(count[v] + 1, 3));
        }
    }
    for (std::size_t v = 0; v < vertices; ++v)
        if (count[v] != 2) out[v] = {no_element, no_element};
    return out;
}

std::array<std::int64_t, 3> wide(LatticePoint p) { return {p.x, p.y, p.z}; }

}  // namespace

MeshEdges find_edges(std::size_t vertices, std::span<const Triangle> triangles) {
    const auto sides = sorted_sides(vertices, triangles);
    MeshEdges out;
    out.of_triangle.assign(triangles.size(), {no_element, no_element, no_element});
    // The first corner that names each side's edge.
    std::vector<std::uint32_t> named_first(3 * triangles.size(), no_element);
    for (std::size_t i = 0, begin = 0; i < sides.size(); ++i) {
        if (sides[i].low != sides[begin].low || sides[i].high != sides[begin].high) begin = i;
        named_first[sides[i].corner] = sides[begin].corner;
    }
    for (std::uint32_t corner = 0; corner < named_first.size(); ++corner) {
        const auto first = named_first[corner];
        if (first == no_element) continue;
        const std::uint32_t t = corner / 3;
        if (first == corner) {
            const std::uint32_t from = triangles[t][corner % 3], to = triangles[t][(corner + 1) % 3];
            out.of_triangle[t][corner % 3] = static_cast<std::uint32_t>(out.ends.size());
            out.ends.push_back({std::min(from, to), std::max(from, to)});
            out.triangles.push_back({t, no_element});
            out.sides.push_back(1);
            continue;
        }
        const auto e = out.of_triangle[t][corner % 3] = out.of_triangle[first / 3][first % 3];
        if (++out.sides[e] == 2) out.triangles[e][1] = t;
    }
    return out;
}

std::vector<EdgeStencil> edge_stencils(std::size_t vertices, std::span<const Triangle> triangles,
                                       const MeshEdges& edges, std::span<const std::uint32_t> wanted) {
    std::vector<std::array<std::uint32_t, 2>> borders;
    for (const auto sides : edges.sides) {
        if (sides != 1) continue;
        borders = borders_at(vertices, edges);
        break;
    }
    // The vertex behind a side of a triangle.
    const auto behind = [&](std::uint32_t triangle, std::uint32_t side) {
        if (edges.sides[side] != 2) return no_element;
        const auto& both = edges.triangles[side];
        const auto& ends = edges.ends[side];
        return third_corner(triangles[both[both[0] == triangle ? 1 : 0]], ends[0], ends[1]);
    };
    std::vector<EdgeStencil> out;
    out.reserve(wanted.size());
    for (const auto e : wanted) {
        EdgeStencil s;
        s.a = edges.ends[e][0];
        s.b = edges.ends[e][1];
        s.across = {no_element, no_element};
        s.wings = {{{no_element, no_element}, {no_element, no_element}}};
        s.along = {no_element, no_element};
        if (edges.sides[e] == 2)
            for (std::size_t k = 0; k < 2; ++k) {
                const auto t = edges.triangles[e][k];
                const auto& sides = edges.of_triangle[t];
                const std::size_t i = sides[0] == e ? 0 : sides[1] == e ? 1 : 2, next = (i + 1) % 3, last = (i + 2) % 3;
                s.across[k] = triangles[t][last];
                s.wings[k] = {behind(t, sides[last]), behind(t, sides[next])};
                if (triangles[t][i] != s.a) std::swap(s.wings[k][0], s.wings[k][1]);
            }
        if (edges.sides[e] == 1)
            for (std::size_t k = 0; k < 2; ++k) {
                const auto v = k == 0 ? s.a : s.b;
                if (borders[v][0] == no_element) continue;
                const auto& ends = edges.ends[borders[v][borders[v][0] == e ? 1 : 0]];
                s.along[k] = ends[0] == v ? ends[1] : ends[0];
            }
        out.push_back(s);
    }
    return out;
}

std::array<std::int64_t, 3> butterfly_offset(std::span<const LatticePoint> positions, const EdgeStencil& stencil) {
    const auto a = wide(positions[stencil.a]), b = wide(positions[stencil.b]);
    std::array<std::int64_t, 3> out{};
    if (stencil.across[0] == no_element) {
        if (stencil.along[0] == no_element || stencil.along[1] == no_element) return out;
        const auto before = wide(positions[stencil.along[0]]), behind = wide(positions[stencil.along[1]]);
        for (std::size_t i = 0; i < 3; ++i) out[i] = a[i] + b[i] - before[i] - behind[i];
        return out;
    }
    for (std::size_t k = 0; k < 2; ++k) {
        const auto c = wide(positions[stencil.across[k]]);
        for (std::size_t i = 0; i < 3; ++i) out[i] += 2 * c[i];
        for (std::size_t end = 0; end < 2; ++end) {
            const auto wing = stencil.wings[k][end];
            if (wing != no_element) {
                const auto w = wide(positions[wing]);
                for (std::size_t i = 0; i < 3; ++i) out[i] -= w[i];
                continue;
            }
            // Where nothing is behind, the triangle is continued as a parallelogram.
            const auto &near = end == 0 ? a : b, &far = end == 0 ? b : a;
            for (std::size_t i = 0; i < 3; ++i) out[i] -= near[i] + c[i] - far[i];
        }
    }
    return out;
}

Vector3d tangents_offset(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                         const EdgeStencil& stencil) {
    const Vector3d edge = to_vector(positions[stencil.b]) - to_vector(positions[stencil.a]);
    const Vector3d &at_a = normals[stencil.a], &at_b = normals[stencil.b];
    return (at_b * dot(edge, at_b) - at_a * dot(edge, at_a)) * 0.125;
}

Vector3d expected_vertex(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                         const EdgeStencil& stencil, const SubdivisionRule& rule) {
    Vector3d out = (to_vector(positions[stencil.a]) + to_vector(positions[stencil.b])) * 0.5;
    if (rule.butterfly > 0) {
        const auto offset = butterfly_offset(positions, stencil);
        const double share = static_cast<double>(rule.butterfly) / 128;
        for (std::size_t i = 0; i < 3; ++i) out[i] += static_cast<double>(offset[i]) * share;
    }
    if (rule.tangents > 0)
        out = out + tangents_offset(positions, normals, stencil) * (static_cast<double>(rule.tangents) / 8);
    return out;
}

LatticePoint displaced_vertex(const Vector3d& expected, const Vector3d& normal, double displacement) {
    // To the nearest, halves up: cutting off rounds down once what is below zero is corrected.
    const auto along = [&](std::size_t i) {
        const double moved = expected[i] + normal[i] * displacement + 0.5;
        const auto whole = static_cast<std::int64_t>(moved);
        return within_lattice(whole - (moved < static_cast<double>(whole)));
    };
    return {along(0), along(1), along(2)};
}

void add_vertices(const SubdivisionLevel& level, const SubdivisionRule& rule, std::span<const Triangle> triangles,
                  std::span<const double> displacements, std::vector<LatticePoint>& positions, Threads threads) {
    const auto normals = vertex_normals(positions, triangles);
    const std::size_t first = positions.size();
    positions.resize(first + level.stencils.size());
    const auto before = std::span<const LatticePoint>(positions).first(first);
    parallel_for(level.stencils.size(), threads, 2048, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto& stencil = level.stencils[i];
            // Most are not displaced, and then the normal need not be known.
            const Vector3d along =
                displacements[i] != 0 ? normalised(normals[stencil.a] + normals[stencil.b]) : Vector3d{};
            positions[first + i] =
                displaced_vertex(expected_vertex(before, normals, stencil, rule), along, displacements[i]);
        }
    });
}

namespace {

// Cuts the triangles whose edges have a new vertex, and calls part(parent, corners, sides) with each that comes of it,
// in their order. places: of the old vertices; a new one lies in the middle of its edge. vertex_of_edge: the number of
// each edge's new vertex, or no_element. Sides have a number each that tells them from all others: twice that of an
// edge, and one more for its upper half if it is split; after those, three for the sides that are new within each
// triangle.
template <class Part>
void cut_triangles(std::span<const Triangle> triangles, const MeshEdges& edges,
                   std::span<const std::uint32_t> vertex_of_edge, std::span<const Vector3d> places, const Part& part) {
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const auto& corners = triangles[t];
        const auto cut = [&](const Triangle& of_part, const std::array<std::uint32_t, 3>& its_sides) {
            part(t, of_part, its_sides);
        };
        const auto& sides = edges.of_triangle[t];
        if (sides[0] == no_element) {
            cut(corners, sides);
            continue;
        }
        std::array<std::uint32_t, 3> middle;
        std::size_t split = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            middle[i] = vertex_of_edge[sides[i]];
            split += middle[i] != no_element;
        }
        if (split == 0) {
            cut(corners, {2 * sides[0], 2 * sides[1], 2 * sides[2]});
            continue;
        }
        // Turned so that the side that is split, or is not, where one is alone, is the first.
        std::size_t k = 0;
        while (split < 3 && (middle[k] != no_element) != (split == 1)) ++k;
        const auto a = corners[k], b = corners[(k + 1) % 3], c = corners[(k + 2) % 3];
        const auto ab = middle[k], bc = middle[(k + 1) % 3], ca = middle[(k + 2) % 3];
        const auto whole = [&](std::size_t side) { return 2 * sides[(k + side) % 3]; };
        const auto half = [&](std::size_t side, std::uint32_t end) {
            const auto e = sides[(k + side) % 3];
            return 2 * e + (end != edges.ends[e][0]);
        };
        const auto inside = static_cast<std::uint32_t>(2 * edges.size() + std::size_t{3} * t);
        if (split == 1) {
            cut({a, ab, c}, {half(0, a), inside, whole(2)});
            cut({ab, b, c}, {half(0, b), whole(1), inside});
        } else if (split == 2) {
            const Vector3d from_a = (places[b] + places[c]) * 0.5 - places[a];
            const Vector3d from_b = (places[c] + places[a]) * 0.5 - places[b];
            if (dot(from_a, from_a) <= dot(from_b, from_b)) {
                cut({a, b, bc}, {whole(0), half(1, b), inside});
                cut({a, bc, ca}, {inside, inside + 1, half(2, a)});
            } else {
                cut({a, b, ca}, {whole(0), inside, half(2, a)});
                cut({b, bc, ca}, {half(1, b), inside + 1, inside});
            }
            cut({ca, bc, c}, {inside + 1, half(1, c), half(2, c)});
        } else {
            cut({a, ab, ca}, {half(0, a), inside, half(2, a)});
            cut({ab, b, bc}, {half(0, b), half(1, b), inside + 1});
            cut({ca, bc, c}, {inside + 2, half(1, c), half(2, c)});
            cut({ab, bc, ca}, {inside + 1, inside + 2, inside});
        }
    }
}

// The edges of what cut_triangles() gives, in the order in which it names them; parts: how many triangles there are.
class EdgesOfParts {
public:
    EdgesOfParts(const MeshEdges& edges, std::size_t triangles, std::size_t parts)
        : number_(2 * edges.size() + 3 * triangles, no_element) {
        const std::size_t most = 3 * parts / 2 + 1;  // unless there are many borders
        out_.ends.reserve(most);
        out_.triangles.reserve(most);
        out_.sides.reserve(most);
        out_.of_triangle.reserve(parts);
    }
    void add(const Triangle& corners, const std::array<std::uint32_t, 3>& sides) {
        const auto t = static_cast<std::uint32_t>(out_.of_triangle.size());
        auto& own = out_.of_triangle.emplace_back(sides);
        if (sides[0] == no_element) return;
        for (std::size_t i = 0; i < 3; ++i) {
            auto& e = number_[sides[i]];
            if (e == no_element) {
                e = static_cast<std::uint32_t>(out_.ends.size());
                const auto from = corners[i], to = corners[(i + 1) % 3];
                out_.ends.push_back({std::min(from, to), std::max(from, to)});
                out_.triangles.push_back({t, no_element});
                out_.sides.push_back(1);
            } else if (++out_.sides[e] == 2) {
                out_.triangles[e][1] = t;
            }
            own[i] = e;
        }
    }
    MeshEdges take() { return std::move(out_); }

private:
    std::vector<std::uint32_t> number_;  // of each side that has been named
    MeshEdges out_;
};

}  // namespace

std::vector<Vector3d> places_of(std::span<const LatticePoint> positions) {
    std::vector<Vector3d> out;
    out.reserve(positions.size());
    for (const auto p : positions) out.push_back(to_vector(p));
    return out;
}

void add_middles(const SubdivisionLevel& level, std::vector<Vector3d>& places) {
    places.reserve(places.size() + level.stencils.size());
    for (const auto& s : level.stencils) places.push_back((places[s.a] + places[s.b]) * 0.5);
}

std::optional<SubdivisionLevel> split_edges(std::span<const Vector3d> places, std::span<const Triangle> triangles,
                                            const MeshEdges& edges, std::span<const std::uint8_t> split,
                                            std::size_t most_vertices, MeshEdges* next) {
    SubdivisionLevel level;
    level.first = static_cast<std::uint32_t>(places.size());
    std::vector<std::uint32_t> wanted, vertex_of_edge(edges.size(), no_element);
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
        if (split[e] == 0) continue;
        vertex_of_edge[e] = static_cast<std::uint32_t>(level.first + wanted.size());
        wanted.push_back(e);
    }
    if (wanted.size() > most_vertices - std::min<std::size_t>(level.first, most_vertices)) return std::nullopt;
    // Triangles may lie on each other, and grow though vertices do not.
    std::uint64_t pieces = triangles.size();
    for (const auto e : wanted) pieces += edges.sides[e];
    if (pieces > std::uint64_t{4} * most_vertices) return std::nullopt;
    const auto cut = static_cast<std::size_t>(pieces);
    level.stencils = edge_stencils(places.size(), triangles, edges, wanted);
    level.beside.reserve(wanted.size());
    for (const auto own : wanted) {
        std::array<std::uint32_t, 4> beside{no_element, no_element, no_element, no_element};
        std::size_t count = 0;
        for (const auto t : edges.triangles[own]) {
            if (t == no_element) continue;
            for (const auto e : edges.of_triangle[t])
                if (e < own && vertex_of_edge[e] != no_element) beside[count++] = vertex_of_edge[e];
        }
        level.beside.push_back(beside);
    }
    level.triangles.reserve(cut);
    level.parent.reserve(cut);
    std::optional<EdgesOfParts> parts;
    if (next) parts.emplace(edges, triangles.size(), cut);
    cut_triangles(triangles, edges, vertex_of_edge, places,
                  [&](std::uint32_t parent, const Triangle& corners, const std::array<std::uint32_t, 3>& sides) {
                      level.triangles.push_back(corners);
                      level.parent.push_back(parent);
                      if (parts) parts->add(corners, sides);
                  });
    if (next) *next = parts->take();
    return level;
}

std::optional<std::vector<SubdivisionLevel>> subdivide(const LatticeMesh& base, const SubdivisionDepth& depth,
                                                       std::size_t most_vertices, MeshEdges* finest) {
    std::vector<SubdivisionLevel> out;
    // Where vertices lie on the base: halves of integers at most most_levels times, so exact.
    auto flat = places_of(base.positions);
    std::vector<std::uint8_t> split;
    // Two triangles that lie on each other have edges of their own from the first level on.
    auto edges = depth.levels > 0 || finest ? find_edges(flat.size(), base.triangles) : MeshEdges{};
    for (std::uint32_t k = 1; k <= depth.levels; ++k) {
        const std::span<const Triangle> triangles = out.empty() ? base.triangles : out.back().triangles;
        const double longest = static_cast<double>(std::int64_t{depth.longest_edge} << (depth.levels - k));
        split.resize(edges.size());
        for (std::uint32_t e = 0; e < edges.size(); ++e) {
            const Vector3d side = flat[edges.ends[e][1]] - flat[edges.ends[e][0]];
            split[e] = dot(side, side) > longest * longest;
        }
        MeshEdges next;
        auto level =
            split_edges(flat, triangles, edges, split, most_vertices, k < depth.levels || finest ? &next : nullptr);
        if (!level) return std::nullopt;
        add_middles(*level, flat);
        edges = std::move(next);
        out.push_back(std::move(*level));
    }
    if (finest) *finest = std::move(edges);
    return out;
}

std::vector<std::uint8_t> bent_edges(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                     const MeshEdges& edges, double least) {
    std::vector<std::uint8_t> out(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
        EdgeStencil ends;
        ends.a = edges.ends[e][0];
        ends.b = edges.ends[e][1];
        const Vector3d off = tangents_offset(positions, normals, ends);
        out[e] = dot(off, off) >= least * least;
    }
    return out;
}

}  // namespace htvm::internal
