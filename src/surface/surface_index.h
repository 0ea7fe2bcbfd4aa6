// The encoder's index of a surface: finds what lies nearest to a point, either in any direction, or among points that
// face the same way within reach. Used to choose, to register and to control quality, never to predict: the decoder
// does not have it, and ties may be resolved either way. Positions are in lattice units or millimetres, as the caller's
// are.
//
// There are two searches, since neither can do the other's task. A tree finds the nearest point however far away it is,
// but ignores directions. A grid finds only what is within a few cells, but skips points that face elsewhere, and can
// begin where the search of a neighbouring query ended.
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
#include "surface/vertex_fans.h"

namespace htvm::internal {

using Point3f = Vector3f;

// A lattice point as the float point that the searches take.
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

// The nearest of the points that are reached from one beside it to the next, beginning at `from`, as long as the
// distance shrinks. beside: calls its second argument with the index of each point beside its first.
template <class Beside>
Neighbour nearest_along(std::span<const Point3f> points, const Point3f& query, std::uint32_t from,
                        const Beside& beside) {
    const auto squared_distance = [&](std::uint32_t point) {
        const Point3f& p = points[point];
        const Point3f apart = {p[0] - query[0], p[1] - query[1], p[2] - query[2]};
        return apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
    };
    Neighbour best{from, squared_distance(from)};
    for (auto last = std::numeric_limits<std::uint32_t>::max(); last != best.index;) {
        last = best.index;
        beside(last, [&](std::uint32_t next) {
            const float d = squared_distance(next);
            if (d < best.squared_distance) best = {next, d};
        });
    }
    return best;
}

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

// Points with normals in the cells of a hashed grid. Normals matter because registration must not match the front of an
// arm to its back, nor a hand to the hip beside it.
class OrientedPoints {
public:
    static constexpr std::uint32_t no_point = std::numeric_limits<std::uint32_t>::max();

    OrientedPoints() : OrientedPoints({}, {}, 1) {}
    // Copies the points. normals: one per point, of unit length or zero (a zero normal matches any). cell: side length
    // of the grid's cells, > 0; searches are fast within a few cells. Points that are not finite are never found.
    OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell);
    // The nearest point within reach whose normal agrees with the given one: their dot product is at least `agreement`.
    // Where several are equally near, the lowest index counts. guess: the index of a point that may be near, such as
    // the match of a neighbouring query, or no_point. A good guess makes the search faster; it never changes the
    // result.
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
    // Eight cells in a row along z form a block, and their buckets are consecutive too, so that a row of cells is one
    // run of entries. Points of several blocks may share a bucket.
    std::vector<std::uint32_t> first_;  // where each bucket begins
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> place_;  // the place of each point among the entries; no_point for points that are not
                                        // finite
};

// ---- Surfaces

struct SurfacePoint {
    static constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t triangle = nothing;  // index of the triangle, or of the vertex if the mesh has no triangles;
                                       // `nothing` if nothing was found
    std::array<float, 3> shares{};     // weights of the triangle's corners, each 0..1, sum 1; without triangles 1, 0, 0
    Point3f point{};
    float squared_distance = 0;
    bool found() const { return triangle != nothing; }
};

// The point of a triangle that is nearest to a query, in floats: faster than closest_on_triangle(), and what captured
// surfaces are asked for needs no more.
struct NearOnTriangle {
    std::array<float, 3> shares{};  // of the corners
    float squared_distance = std::numeric_limits<float>::infinity();
};
// Infinitely far if the triangle's plane, or the line of a side that the query lies beyond, is seen to be farther away
// than `least`, squared; or if it faces otherwise than it must, if there is something that it must.
NearOnTriangle near_on_triangle(const Point3f& first, const Point3f& second, const Point3f& third, const Point3f& query,
                                float least, const Facing* facing = nullptr);

struct FacingReach {
    float reach = 30;         // in the unit of the positions: nothing farther away is found
    float agreement = 0.35F;  // least dot product of the two normals
    bool along = false;       // whether to go along the surface, from the guess and beyond the triangles around the
                              // nearest vertex: faster where most queries lie on one sheet
};

struct SurfaceIndexOptions {
    // Side length of the grid's cells for searches by direction, about two edges long, > 0; 0: no such searches.
    float cell = 0;
    std::size_t samples = 0;  // approximate number of vertices in the coarse grid
    Threads threads = {};
};

// The surface of a mesh, prepared for searches; read-only once built.
class SurfaceIndex {
public:
    // Copies what it needs. Every index must be < positions.size(), positions must be finite.
    SurfaceIndex(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                 const SurfaceIndexOptions& options = {});
    SurfaceIndex(SurfaceIndex&&) noexcept;
    SurfaceIndex& operator=(SurfaceIndex&&) noexcept;
    ~SurfaceIndex();

    // Whether there are no vertices, so that nothing can be found.
    bool empty() const { return positions.empty(); }

    // The closest point of the whole surface, almost always exactly; never farther away than the nearest vertex.
    //
    // The search begins at the nearest vertex: the triangles around it are tried, then those around the corners of the
    // best one, as long as the distance shrinks. Two additions find most of what this would miss: triangles much longer
    // than most also have points spread over them that can be found; and if the result is far away compared to the
    // edges there, a second search begins on the other side of the query, where another sheet may pass by without
    // having a vertex as near.
    //
    // Vertices at the same position count as one, so that walks do not stop at the seams of a mesh in pieces or of a
    // coarsely quantised one. Vertices that no triangle uses are not part of the surface, unless there are no triangles
    // at all: then the vertices are the surface. The surface must not be empty(), the query must be finite. Several
    // threads may call it at once; the first call builds the tree.
    SurfacePoint closest(const Point3f& query) const;

    // The closest point on the triangles around the nearest vertex within reach; that vertex and the triangles must
    // face as `normal` does. Vertices at a seam are not merged: each side keeps its own, which face as their side does.
    // Merged, they would face between the two sides, and T-frames took 1 to 2 % more bits on captures in pieces. Needs
    // options.cell > 0.
    //
    // guess: a vertex that may be near, such as that of a neighbouring query, or OrientedPoints::no_point; it is set to
    // the vertex found. Unless `within.along` it never changes the result.
    SurfacePoint closest_facing(const Point3f& query, const Point3f& normal, const FacingReach& within,
                                std::uint32_t& guess) const;

    // The vertex that is nearest to the query, however it faces, found from vertex to vertex beginning at `from`, as
    // long as the distance shrinks: the nearest of this sheet of the surface, as a rule. Needs options.cell > 0.
    Neighbour nearest_along(const Point3f& query, std::uint32_t from) const;

    // As OrientedPoints::nearest() among all vertices, but with `within.along`, if `guess` is near, the vertex is
    // looked for along the surface from there, and is taken if it faces the right way and lies no farther than its
    // neighbours. The first search that is not along the surface makes the grid.
    OrientedMatch nearest_facing(const Point3f& query, const Point3f& normal, const FacingReach& within,
                                 std::uint32_t guess) const;

    // The closest point of the surface near the query, however it faces: on the triangles around the nearest vertex
    // within reach, then around their corners, as long as the distance shrinks. Finds less than closest() does under
    // long triangles, and is faster. Needs options.cell > 0. guess: as of closest_facing().
    SurfacePoint closest_within(const Point3f& query, float reach, std::uint32_t& guess) const;

    // Whether the triangles around a vertex go all the way round it: it lies on no border, nor where surfaces touch. Of
    // fans of more than eight this is not known, and false. Needs options.cell > 0.
    bool is_inside(std::uint32_t vertex) const { return fans_[vertex].closed(); }

    // Says that a search will soon begin at this vertex: VertexFans::expect().
    void expect(std::uint32_t vertex) const { fans_.expect(vertex); }
    // Moves each guess to the vertex where a search along the surface from it would end, if it is within `near`: many
    // searches side by side wait less for memory than one after the other. Numbers beyond the vertices stay.
    void walk_all(std::span<const Point3f> queries, float near, std::span<std::uint32_t> guesses) const {
        fans_.walk_all(queries, near * near, guesses);
    }
    float begins_near() const;  // from farther away a search does not go along the surface

    std::vector<Point3f> positions;  // of the mesh's vertices
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;            // one per vertex, or none
    std::vector<std::uint8_t> from_border;  // of each vertex: edges_from_border(); or none: nobody asks for borders
    // For searches by direction; empty if there are none:
    TrianglesAround around;              // each vertex
    std::vector<Point3f> normals;        // one per vertex, unit length; zero where no triangle has an area
    std::vector<std::uint32_t> samples;  // every n-th vertex, for far searches and for matching back from the target
                                         // to the reference
    float fine_gap = 0, coarse_gap = 0;  // approximate spacing of the vertices and of the samples
    OrientedPoints coarse;               // contains the samples; indices found are indices of samples

private:
    struct Anywhere;
    struct Best;
    void find_directions(const SurfaceIndexOptions& options);
    Best closest_around(std::uint32_t vertex, const Point3f& query, const Facing* facing) const;
    void try_around(std::uint32_t vertex, const Point3f& query, const Facing* facing, Best& best) const;
    SurfacePoint found(const Best& best) const;
    const Anywhere& anywhere() const;
    const OrientedPoints& grid() const;  // of all vertices

    VertexFans fans_;
    float cell_ = 0;

    struct OnDemand;
    std::unique_ptr<OnDemand> on_demand_;
};

// closest_facing() for many queries. normals: one per query. guesses: a vertex that may be near, one per query, which
// is set to the vertex found; or none, if neighbouring queries mostly follow each other. Where a query has no guess, or
// OrientedPoints::no_point, what the query before it found is the guess.
std::vector<SurfacePoint> closest_facing(const SurfaceIndex& surface, std::span<const Point3f> queries,
                                         std::span<const Point3f> normals, const FacingReach& within, Threads threads,
                                         std::span<std::uint32_t> guesses = {});

// The approximate spacing of `count` points spread over the surface.
float point_gap(std::span<const Point3f> positions, std::span<const Triangle> triangles, std::size_t count);

}  // namespace htvm::internal
