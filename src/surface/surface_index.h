// The encoder's index of a surface: what lies nearest to a point, from anywhere, or among what faces the same way
// within reach. Used to choose, to register and to steer, never to predict: the decoder has none of it, and ties may
// fall either way. Positions are in lattice units or millimetres, as the caller has them.
//
// Two searches, since each fails at the other's task: a tree finds the nearest point however far it is, but knows no
// directions; a grid finds only within a few cells, but passes over what faces elsewhere, and begins where a
// neighbouring query ended.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

using Point3f = Vector3f;

// A lattice point as the searches take it.
inline Point3f point_of(LatticePoint p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}
std::vector<Point3f> points_of(std::span<const LatticePoint> positions);
std::vector<Point3f> points_of(std::span<const Vector3d> vectors);

// ---- Points

struct Neighbour {
    std::uint32_t index = 0;
    float squared_distance = 0;
};

// Points in a k-d tree (nanoflann's).
class NearestPoints {
public:
    // Copies the points.
    explicit NearestPoints(std::span<const Point3f> points);
    NearestPoints(NearestPoints&&) noexcept;
    NearestPoints& operator=(NearestPoints&&) noexcept;
    ~NearestPoints();
    // There must be at least one point.
    Neighbour nearest(const Point3f& query) const;
    std::size_t size() const;
    const Point3f& point(std::size_t index) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

struct OrientedMatch {
    std::uint32_t index = 0;
    float squared_distance = 0;
    bool found = false;
};

// Points with normals in the cells of a hashed grid: registration must not match the front of an arm to its back, nor a
// hand to the hip beside it.
class OrientedPoints {
public:
    static constexpr std::uint32_t no_point = std::numeric_limits<std::uint32_t>::max();

    OrientedPoints() : OrientedPoints({}, {}, 1) {}
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

// ---- Surfaces

struct SurfacePoint {
    static constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t triangle = nothing;  // index; of a mesh without triangles: the vertex's; nothing: nothing was found
    std::array<float, 3> shares{};     // of the triangle's corners, sum 1, each 0..1; without triangles 1, 0, 0
    Point3f point{};
    float squared_distance = 0;
    bool found() const { return triangle != nothing; }
};

struct FacingReach {
    float reach = 30;         // the positions' unit: farther away nothing is found
    float agreement = 0.35F;  // least product of the two normals
};

struct SurfaceIndexOptions {
    // The side of the grid's cells for searches that mind directions, about two edges long, > 0; 0: there are none.
    float cell = 0;
    std::size_t samples = 0;  // about how many vertices the coarse grid knows
    Threads threads = {};
};

// A mesh's surface, ready for searches; read-only once made.
class SurfaceIndex {
public:
    // Copies what it needs. Every index < positions.size(), positions finite.
    SurfaceIndex(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                 const SurfaceIndexOptions& options = {});
    SurfaceIndex(SurfaceIndex&&) noexcept;
    SurfaceIndex& operator=(SurfaceIndex&&) noexcept;
    ~SurfaceIndex();

    // Whether there is nothing to be close to: no vertices.
    bool empty() const { return positions.empty(); }

    // The closest point of all, almost always; never one farther than the nearest vertex. From the nearest vertex the
    // triangles around it are tried, then those around the corners of the best, as long as that comes nearer; triangles
    // much longer than most are also found by points spread over them, and where the result is far, beside short edges,
    // a second search begins on the query's other side, where another sheet may pass with no vertex as near. Vertices
    // at the same place count as one, so that the seams of a mesh in pieces, or of one that was quantised coarsely,
    // stop no walk. Vertices that no triangle uses are no part of the surface, unless there are no triangles: then the
    // vertices are the surface.
    // Must not be empty(), the query finite. Threads may call it at once; the first call makes the tree.
    SurfacePoint closest(const Point3f& query) const;

    // The closest point on the triangles around the nearest vertex within reach that faces as `normal` does, and which
    // face so themselves. Along a seam each side has vertices of its own, which face as their side does: made one, they
    // would face between the two, and T-frames took 1 to 2 % more bits on captures in pieces.
    // Made with options.cell > 0. guess: the vertex to begin with, OrientedPoints::no_point for none; becomes the one
    // that was found.
    SurfacePoint closest_facing(const Point3f& query, const Point3f& normal, const FacingReach& within,
                                std::uint32_t& guess) const;

    std::vector<Point3f> positions;  // of the mesh's vertices
    std::vector<Triangle> triangles;
    // For searches that mind directions; empty without:
    TrianglesAround around;                 // each vertex
    std::vector<Point3f> normals;           // one per vertex, unit length; zero where no triangle has an area
    std::vector<Point3f> triangle_normals;  // likewise
    std::vector<std::uint32_t> samples;     // every so many vertices, for searches far away and for the way back
    float fine_gap = 0, coarse_gap = 0;     // about how far apart vertices and samples are
    OrientedPoints fine;                    // all vertices
    OrientedPoints coarse;                  // the samples; found indices count in samples

private:
    struct Anywhere;
    void find_directions(const SurfaceIndexOptions& options);
    const Anywhere& anywhere() const;

    struct OnDemand;
    std::unique_ptr<OnDemand> on_demand_;
};

// closest_facing() for many queries, in an order in which neighbours are mostly near each other. normals: one per
// query.
std::vector<SurfacePoint> closest_facing(const SurfaceIndex& surface, std::span<const Point3f> queries,
                                         std::span<const Point3f> normals, const FacingReach& within, Threads threads);

// About how far apart neighbours are where `count` points are spread over the surface.
float point_gap(std::span<const Point3f> positions, std::span<const Triangle> triangles, std::size_t count);

}  // namespace htvm::internal
