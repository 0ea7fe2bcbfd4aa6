// The nearest point of a surface, exact and with bounded work, for zippering. Its rules are part of the stream format
// (bitstream.md, 8.9): a grid of cells, each with a bounded list of triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::internal::zipping {

inline constexpr std::uint32_t none = 0xFFFFFFFFu;

struct Direction {
    double x = 0, y = 0, z = 0;
};
inline double dot(Direction a, Direction b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Direction cross(Direction a, Direction b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
using internal::operator+;  // for lattice points; the operator below would hide it
inline Direction operator+(Direction a, Direction b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Direction direction(LatticePoint from, LatticePoint to) {
    const LatticePoint d = to - from;
    return {static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z)};
}
// Normal of a triangle; its length is twice the area.
inline Direction normal_of(std::span<const LatticePoint> positions, const Triangle& t) {
    return cross(direction(positions[t[0]], positions[t[1]]), direction(positions[t[0]], positions[t[2]]));
}

struct Box {
    LatticePoint low, high;
};
Box box_of(std::span<const LatticePoint> positions, const Triangle& t);

// The side length of a grid's cells for a given reach.
std::int64_t cell_side(std::int64_t reach);

// Tells which cells of a grid may be near some triangles. It saves searching where nothing is, and changes no result:
// it never misses a cell, but may name too many.
class CellFilter {
public:
    explicit CellFilter(std::int64_t reach);
    void mark(const Box& box);  // marks the cells that the box touches
    void widen();               // also marks all cells around the marked ones; call once, after the last mark()
    bool may_touch(const Box& box) const;

private:
    std::int64_t cell_;
    bool everything_ = false;
    std::vector<std::uint64_t> bits_;         // hashed
    std::vector<std::uint64_t> marked_;       // keys, possibly repeated
    std::vector<std::uint64_t> last_marked_;  // hashed
};

// The nearest point on a triangle, and where on it the point lies.
struct SurfacePoint {
    std::uint32_t triangle = none;  // none: nothing within reach
    double squared_distance = 0;    // lattice units
    int side = -1;                  // 0, 1, 2: inside the side from corner `side` to the next
    int corner = -1;                // 0, 1, 2: at that corner; if side and corner are -1: inside the triangle
};

// A surface made of some of a mesh's triangles.
class SurfaceGrid {
public:
    // used: indices of triangles, ascending. reach: lattice units, > 0, < 2^26. Keeps the spans, which must outlive it.
    SurfaceGrid(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                std::span<const std::uint32_t> used, std::int64_t reach);

    // The nearest point within reach on triangles that face the same way: dot(normal, facing) > 0. Where several
    // triangles are equally near, the lowest index counts. Thread-safe.
    SurfacePoint nearest(LatticePoint point, Direction facing) const;

private:
    struct Entry {
        Box box;
        std::uint32_t triangle = 0;
    };
    struct Cell {
        std::uint64_t key = 0;  // 0: free
        std::uint32_t begin = 0, end = 0;
    };
    void look_at(const Entry& entry, LatticePoint point, Direction facing, SurfacePoint& best) const;
    void look_into(std::uint64_t key, LatticePoint point, Direction facing, SurfacePoint& best) const;
    std::size_t slot_of(std::uint64_t key) const;

    std::span<const LatticePoint> positions_;
    std::span<const Triangle> triangles_;
    std::int64_t reach_ = 1, cell_ = 32;
    std::vector<Cell> cells_;  // hashed by key, open addressing
    std::vector<Entry> entries_;
};

}  // namespace htvm::internal::zipping
