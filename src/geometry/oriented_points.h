// Nearest points among those that face the same way: registration must not match the front of an arm to its back, nor
// a hand to the hip beside it. Encoder side.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/nearest_points.h"

namespace htvm {

struct OrientedMatch {
    std::uint32_t index = 0;
    float squared_distance = 0;
    bool found = false;
};

// Points with normals in the cells of a hashed grid.
class OrientedPoints {
public:
    // Copies the points; normals: one a point, of unit length or zero (a zero normal matches any). cell: the side of
    // the grid's cells, > 0; searches are fast up to a few cells far. Points that are not finite are never found.
    OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell);
    // The nearest point within reach whose normal agrees with the given one: their product is at least `agreement`.
    // Of equally near ones the lowest.
    OrientedMatch nearest(const Point3f& query, const Point3f& normal, float reach, float agreement) const;

private:
    struct Entry {
        Point3f point, normal;
        std::uint32_t index;
    };
    using Cell = std::array<std::int32_t, 3>;
    Cell cell_of(const Point3f& p) const;
    std::uint32_t bucket_of(const Cell& cell) const;

    float side_, per_side_;
    std::uint32_t mask_ = 0;
    std::vector<std::uint32_t> first_;  // of each bucket; points of several cells may share one
    std::vector<Entry> entries_;
};

}  // namespace htvm
