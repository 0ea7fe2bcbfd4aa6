#include "core/geometry.h"

#include <algorithm>
#include <limits>

namespace htvm::internal {
namespace {

template <class Point>
std::vector<Vector3d> normals_of(std::span<const Point> positions, std::span<const Triangle> triangles) {
    std::vector<Vector3d> out(positions.size(), Vector3d{});
    for (const auto& t : triangles) {
        const Vector3d across = area_vector(positions, t);
        for (const auto v : t) out[v] = out[v] + across;
    }
    for (auto& n : out) n = normalised(n);
    return out;
}

template <class Point>
double mean_edge_of(std::span<const Point> positions, std::span<const Triangle> triangles, std::size_t every) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < triangles.size(); k += every, count += 3)
        for (std::size_t i = 0; i < 3; ++i)
            sum += length(to_vector(positions[triangles[k][i]]) - to_vector(positions[triangles[k][(i + 1) % 3]]));
    return count > 0 ? sum / static_cast<double>(count) : 0;
}

// Corners relative to the query point, so the task is to find the point nearest to the origin.
using Corners = std::array<Vector3d, 3>;

// Takes the point of the side opposite to `corner` that is nearest to the origin, if it beats the best so far.
void try_side(const Corners& corners, std::size_t corner, TrianglePoint& best) {
    const std::size_t i = (corner + 1) % 3, j = (corner + 2) % 3;
    const auto &a = corners[i], &b = corners[j];
    const Vector3d side = b - a;
    const double squared_length = dot(side, side);
    const double t = squared_length > 0 ? std::clamp(-dot(a, side) / squared_length, 0.0, 1.0) : 0.0;
    const Vector3d p = a + side * t;
    const double squared = dot(p, p);
    if (!(squared < best.squared_distance)) return;
    best.squared_distance = squared;
    best.shares = {};
    best.shares[i] = 1 - t;
    best.shares[j] = t;
}

}  // namespace

std::vector<Vector3d> vertex_normals(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    return normals_of(positions, triangles);
}
std::vector<Vector3d> vertex_normals(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    return normals_of(positions, triangles);
}

double mean_edge(std::span<const LatticePoint> positions, std::span<const Triangle> triangles, std::size_t every) {
    return mean_edge_of(positions, triangles, every);
}
double mean_edge(std::span<const Vector3f> positions, std::span<const Triangle> triangles, std::size_t every) {
    return mean_edge_of(positions, triangles, every);
}

// If the origin projects outside the triangle, the nearest point lies on a side that has the projection beyond it.
// Trying these sides one by one stays robust for slivers, where classifying the region of the projection does not.
TrianglePoint closest_on_triangle(const Vector3d& p, const Vector3d& first, const Vector3d& second,
                                  const Vector3d& third) {
    const Corners corners = {first - p, second - p, third - p};
    const auto& [a, b, c] = corners;
    const Vector3d ab = b - a, ac = c - a, normal = cross(ab, ac);
    const double area = dot(normal, normal), scale = dot(ab, ab) * dot(ac, ac);
    TrianglePoint best;
    best.squared_distance = std::numeric_limits<double>::infinity();
    if (!(area > 1e-20 * scale)) {
        for (std::size_t corner = 0; corner < 3; ++corner) try_side(corners, corner, best);
        return best;
    }
    const double v = dot(normal, cross(ac, a)) / area, w = dot(normal, cross(a, ab)) / area, u = 1 - v - w;
    if (u >= 0 && v >= 0 && w >= 0) {
        const double height = dot(normal, a);
        return {{u, v, w}, height * height / area};
    }
    if (u < 0) try_side(corners, 0, best);
    if (v < 0) try_side(corners, 1, best);
    if (w < 0) try_side(corners, 2, best);
    return best;
}

TrianglesAround triangles_around(std::size_t vertices, std::span<const Triangle> triangles) {
    TrianglesAround out;
    out.first.assign(vertices + 1, 0);
    for (const auto& t : triangles)
        for (const auto v : t) ++out.first[v + std::size_t{1}];
    for (std::size_t v = 0; v < vertices; ++v) out.first[v + 1] += out.first[v];
    out.triangles.resize(out.first.back());
    std::vector<std::uint32_t> next(out.first.begin(), out.first.end() - 1);
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
        for (const auto v : triangles[i]) out.triangles[next[v]++] = i;
    return out;
}

VerticesAround vertices_around(std::size_t vertices, std::span<const Triangle> triangles) {
    VerticesAround out;
    std::vector<std::uint32_t> next(vertices + 1, 0);  // where the next triangle's two other corners go
    for (const auto& t : triangles)
        for (const auto v : t) next[v + std::size_t{1}] += 2;
    for (std::size_t v = 0; v < vertices; ++v) next[v + 1] += next[v];
    out.vertices.resize(next.back());
    const std::span<std::uint32_t> named = out.vertices;
    const auto add = [&](std::uint32_t v, std::uint32_t one, std::uint32_t other) {
        named[next[v]] = one;
        named[next[v] + std::size_t{1}] = other;
        next[v] += 2;
    };
    for (const auto& t : triangles) {
        add(t[0], t[1], t[2]);
        add(t[1], t[0], t[2]);
        add(t[2], t[0], t[1]);
    }
    // A triangle adds two corners, one of which a closed mesh has seen. Whether a vertex was seen already cannot be
    // foreseen, so each is written, and what follows overwrites it if it was. Rows only move towards the front.
    out.first.resize(vertices + 1);
    std::vector<std::uint32_t> seen(vertices, std::numeric_limits<std::uint32_t>::max());
    std::uint32_t count = 0, begin = 0;
    for (std::uint32_t v = 0; v < vertices; ++v) {
        seen[v] = v;
        const std::uint32_t end = next[v];
        for (std::uint32_t i = begin; i < end; ++i) {
            const std::uint32_t u = named[i];
            named[count] = u;
            count += seen[u] != v;
            seen[u] = v;
        }
        begin = end;
        out.first[v + std::size_t{1}] = count;
    }
    out.vertices.resize(count);
    out.vertices.shrink_to_fit();
    return out;
}

}  // namespace htvm::internal
