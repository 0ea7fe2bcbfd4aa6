// Closest points on a mesh's surface. A bounding volume hierarchy (Embree's, or where that is left out, one of
// triangle_index_own.cpp) finds the candidates; distances are computed in double. The hierarchy may work in float, so
// it is searched slightly wider than needed to allow for its rounding. The result is thus exactly the smallest double
// distance, whatever the hierarchy looks like.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

// The nearest point of triangle abc to p; a triangle without area is treated as its three sides.
inline Point3 closest_point_of(const Point3& p, const Point3& a, const Point3& b, const Point3& c) {
    return internal::point_at(internal::closest_on_triangle(p, a, b, c).shares, a, b, c);
}

inline double squared_distance_to(const Mesh& mesh, std::uint32_t triangle, const Point3& p) {
    const auto& t = mesh.triangles[triangle];
    return internal::closest_on_triangle(p, to_point(mesh.positions[t[0]]), to_point(mesh.positions[t[1]]),
                                         to_point(mesh.positions[t[2]]))
        .squared_distance;
}

struct ClosestTriangle {
    double squared_distance = 0;  // mm^2
    std::uint32_t triangle = 0;   // of equally near ones, the lowest index
};

class TriangleIndex {
public:
    // Indexes the triangles of `mesh`, which must have at least one and must outlive the index. A limit error if Embree
    // cannot start or runs out of memory.
    static Result<TriangleIndex> build(const Mesh& mesh, internal::Threads threads = {});

    // The triangle nearest to p, which must lie within +-2 * largest_coordinate. `hint` is any triangle, ideally a near
    // one: the search starts with its distance. The result does not depend on it. Thread-safe.
    ClosestTriangle closest(const Point3& p, std::uint32_t hint = 0) const;

    // Calls visit(triangle) for every triangle that may be nearer to p than `radius` mm (a superset of those that are),
    // in no particular order, until visit returns false.
    void visit_near(const Point3& p, double radius, const std::function<bool(std::uint32_t)>& visit) const;

private:
    struct Impl;
    TriangleIndex() = default;
    std::shared_ptr<const Impl> impl_;
};

}  // namespace htvm
