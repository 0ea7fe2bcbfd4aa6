// Plain geometry of triangle meshes: vectors, areas, normals, edges, the closest point of a triangle. The codec, the
// metrics and the tools all use this one kit.
//
// Doubles are computed with + - * / and sqrt alone, in a fixed order, so every machine gets the same bits and decoded
// values may depend on them. On lattice points, differences and cross products are exact integers. Two places have
// their own geometry for a reason: zippering, whose exact rules for the closest point are part of the stream format,
// and the half-edge meshes of the synthetic body, which contain dead triangles.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/exact_arithmetic.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/mesh.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::internal {

inline Vector3d operator+(const Vector3d& a, const Vector3d& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector3d operator-(const Vector3d& a, const Vector3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector3d operator*(const Vector3d& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline double dot(const Vector3d& a, const Vector3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector3d cross(const Vector3d& a, const Vector3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vector3d& a) { return std::sqrt(dot(a, a)); }
// a / |a|; a vector that is zero, or too long for its length to be finite, becomes zero.
inline Vector3d normalised(const Vector3d& a) {
    const double size = length(a);
    return size > 0 && std::isfinite(size) ? Vector3d{a[0] / size, a[1] / size, a[2] / size} : Vector3d{};
}

inline Vector3d to_vector(LatticePoint p) {
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}
inline Vector3d to_vector(const Vector3f& p) { return {p[0], p[1], p[2]}; }
inline Vector3f to_floats(const Vector3d& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// Along the normal of triangle abc (corners counter-clockwise seen from its tip); its length is twice the area.
inline Vector3d area_vector(const Vector3d& a, const Vector3d& b, const Vector3d& c) { return cross(b - a, c - a); }
template <class Point>
Vector3d area_vector(std::span<const Point> positions, const Triangle& t) {
    return area_vector(to_vector(positions[t[0]]), to_vector(positions[t[1]]), to_vector(positions[t[2]]));
}

// Unit normals, one per vertex: the area-weighted sum over the triangles around it; zero if none has an area.
std::vector<Vector3d> vertex_normals(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);
std::vector<Vector3d> vertex_normals(std::span<const Vector3f> positions, std::span<const Triangle> triangles);

// Mean length of the sides of every `every`-th triangle, in the unit of the positions; 0 without triangles.
double mean_edge(std::span<const LatticePoint> positions, std::span<const Triangle> triangles, std::size_t every = 1);
double mean_edge(std::span<const Vector3f> positions, std::span<const Triangle> triangles, std::size_t every = 1);

// A point of a triangle, as the corners' weights: each 0..1, sum 1.
struct TrianglePoint {
    Vector3d shares{};
    double squared_distance = 0;  // from the query point
};
inline Vector3d point_at(const Vector3d& shares, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    return a * shares[0] + b * shares[1] + c * shares[2];
}

// The point of triangle abc nearest to p. A triangle that degenerates to a line or a point, or nearly so, is treated as
// its three sides. Finite corners never give NaN.
TrianglePoint closest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c);

// The triangles around each vertex, ascending, in compressed rows. A triangle that names a vertex twice is listed
// twice.
struct TrianglesAround {
    std::vector<std::uint32_t> first;  // where each vertex's row begins, then the end of the last row
    std::vector<std::uint32_t> triangles;
    std::span<const std::uint32_t> of(std::size_t vertex) const {
        return std::span(triangles).subspan(first[vertex], first[vertex + 1] - first[vertex]);
    }
};
TrianglesAround triangles_around(std::size_t vertices, std::span<const Triangle> triangles);

// The vertices that share a triangle with each vertex, in compressed rows: without repeats or the vertex itself, in the
// order in which its triangles name them.
struct VerticesAround {
    std::vector<std::uint32_t> first;  // where each vertex's row begins, then the end of the last row
    std::vector<std::uint32_t> vertices;
    std::span<const std::uint32_t> of(std::size_t vertex) const {
        return std::span(vertices).subspan(first[vertex], first[vertex + 1] - first[vertex]);
    }
};
VerticesAround vertices_around(std::size_t vertices, std::span<const Triangle> triangles);

}  // namespace htvm::internal
