// Closest points on a surface, and how far one surface is from another. Encoder side: used to choose and to steer,
// never to predict. Lattice units or millimetres, whatever the positions are in.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/nearest_points.h"
#include "htvm/mesh.hpp"

namespace htvm {

struct SurfacePoint {
    std::uint32_t triangle = 0;          // index; of a mesh without triangles: the vertex's
    std::array<float, 3> barycentric{};  // of the triangle's corners, sum 1
    Point3f point{};
    float squared_distance = 0;
};

// A mesh's surface, ready for searches: the closest point among the triangles around the nearest few vertices, which is
// the closest of all on meshes whose edges are not much longer than the query is far away.
class SurfaceSearch {
public:
    // Copies what it needs. Every index < positions.size().
    SurfaceSearch(std::span<const Point3f> positions, std::span<const Triangle> triangles);
    // There must be at least one vertex.
    SurfacePoint closest(const Point3f& query) const;
    std::size_t vertices() const { return points_.size(); }
    const std::vector<Triangle>& triangles() const { return triangles_; }

private:
    NearestPoints points_;
    std::vector<Triangle> triangles_;
    std::vector<std::uint32_t> first_around_, around_;  // triangles around each vertex
};

}  // namespace htvm
