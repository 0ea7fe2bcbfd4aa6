// Closest points on a surface. Encoder side: used to choose and to steer, never to predict. Lattice units or
// millimetres, whatever the positions are in.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/nearest_points.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

struct SurfacePoint {
    std::uint32_t triangle = 0;          // index; of a mesh without triangles: the vertex's
    std::array<float, 3> barycentric{};  // of the triangle's corners, sum 1, each 0..1; without triangles 1, 0, 0
    Point3f point{};
    float squared_distance = 0;
};

// The point of triangle a, b, c closest to the query, as barycentric coordinates: each 0..1, sum 1. A triangle that is
// a line or a point is searched as that; finite corners never give NaN.
std::array<float, 3> closest_barycentric(const Point3f& query, const Point3f& a, const Point3f& b, const Point3f& c);

// A mesh's surface, ready for searches. From the nearest vertex the triangles around it are tried, then those around
// the corners of the best, as long as that comes nearer; triangles much longer than most are also found by points
// spread over them, and where the result is far, beside short edges, a second search begins on the query's other side,
// where another sheet may pass with no vertex as near. Almost always the closest point of all, never further than the
// nearest vertex. Vertices at the same place count as one, so the seams of a mesh in pieces or of one quantised
// coarsely do not stop the search. Vertices that no triangle uses are no part of the surface, unless there are no
// triangles: then the vertices are the surface.
class SurfaceSearch {
public:
    // Copies what it needs. Every index < positions.size(), positions finite.
    SurfaceSearch(std::span<const Point3f> positions, std::span<const Triangle> triangles);
    // Must not be empty(), the query finite. Threads may call it at once.
    SurfacePoint closest(const Point3f& query) const;
    // Whether there is nothing to be close to: no vertices.
    bool empty() const { return places_.size() == 0; }
    std::size_t vertices() const { return vertices_; }  // of the mesh
    const std::vector<Triangle>& triangles() const { return triangles_; }

private:
    std::vector<Point3f> place_vertices(std::span<const Point3f> positions);
    void place_long_triangles(std::vector<Point3f>& places);
    void list_triangles_around_places();

    std::size_t vertices_ = 0;
    std::vector<Triangle> triangles_;
    NearestPoints places_;  // the different positions of the surface's vertices, then points of long triangles
    std::vector<std::uint32_t> vertex_at_;  // the first vertex at each place
    std::vector<Triangle> corners_;         // triangles_ by places instead of vertices
    double doubtful_ = 0;                   // squared distance beyond which another sheet of the surface may be nearer
    std::vector<std::uint32_t> spread_over_;            // the triangle of each point of a long triangle
    std::vector<std::uint32_t> first_around_, around_;  // triangles around each vertex's place
};

}  // namespace htvm::internal
