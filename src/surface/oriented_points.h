// Nearest points among those that face the same way: registration must not match the front of an arm to its back, nor
// a hand to the hip beside it. Encoder side.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "surface/nearest_points.h"

namespace htvm::internal {

struct OrientedMatch {
    std::uint32_t index = 0;
    float squared_distance = 0;
    bool found = false;
};

// Points with normals in the cells of a hashed grid.
class OrientedPoints {
public:
    static constexpr std::uint32_t no_point = std::numeric_limits<std::uint32_t>::max();

    // Copies the points; normals: one per point, of unit length or zero (a zero normal matches any). cell: the side of
    // the grid's cells, > 0; searches are fast up to a few cells far. Points that are not finite are never found.
    OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell);
    // The nearest point within reach whose normal agrees with the given one: their product is at least `agreement`.
    // Of equally near ones the lowest. guess: the index of a point that may be near, such as a neighbouring query's
    // match, or no_point: where it is right the search is quicker; what is found does not depend on it.
    OrientedMatch nearest(const Point3f& query, const Point3f& normal, float reach, float agreement,
                          std::uint32_t guess = no_point) const;

private:
    struct Entry {
        Point3f point, normal;
        std::uint32_t index;
    };
    struct Query {
        Point3f point, normal;
        float agreement;
    };
    using Cell = std::array<std::int32_t, 3>;
    std::int32_t cell_of(float coordinate) const;
    std::uint32_t block_of(std::int32_t x, std::int32_t y, std::int32_t z) const;
    void look_at(std::uint32_t begin, std::uint32_t end, const Query& query, OrientedMatch& best) const;
    bool look_into_ball(float radius, const Query& query, OrientedMatch& best) const;

    float side_, per_side_;
    std::uint32_t mask_ = 0;
    // Eight cells that follow each other along z are a block, and its buckets too: a row of cells is one run of
    // entries. Points of several blocks may share one.
    std::vector<std::uint32_t> first_;  // of each bucket
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> place_;  // of each point among the entries; no_point where it is not finite
};

}  // namespace htvm::internal
