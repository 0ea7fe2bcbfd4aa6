// Subdivision of a triangle mesh: edges are split at a point that their surroundings predict, and the triangles beside
// them are cut to match. Encoder and decoder do the same: on the integer lattice, with doubles as core/geometry.h
// allows them.
//
// Which edges are split is decided edge by edge, so the two triangles beside one agree and no crack opens: a triangle
// of which one, two or three sides are split becomes two, three or four. What was closed stays closed, a border stays
// one border, and any mesh is taken: open, not manifold, with degenerate triangles, which stay as they are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

inline constexpr std::uint32_t no_element = 0xFFFFFFFFu;  // no vertex, edge or triangle

// The edges of a mesh, in the order in which its triangles first name them.
struct MeshEdges {
    std::vector<std::array<std::uint32_t, 2>> ends;         // lower vertex first
    std::vector<std::array<std::uint32_t, 2>> triangles;    // the first two beside it, or no_element
    std::vector<std::uint32_t> sides;                       // how many triangles are beside it
    std::vector<std::array<std::uint32_t, 3>> of_triangle;  // from each corner to the next; no_element if degenerate
    std::size_t size() const { return ends.size(); }
};

// Every index must be < vertices. Linear in vertices and triangles.
MeshEdges find_edges(std::size_t vertices, std::span<const Triangle> triangles);

// What a new vertex on an edge is predicted from. Vertices are equal, or no_element, where there are none.
struct EdgeStencil {
    std::uint32_t a = 0, b = 0;                           // its ends
    std::array<std::uint32_t, 2> across{};                // the third corner of each triangle beside it
    std::array<std::array<std::uint32_t, 2>, 2> wings{};  // behind each triangle: across its sides at a and at b
    std::array<std::uint32_t, 2> along{};                 // of an edge at a border: the border's vertices beyond a, b
};

// The stencils of some edges of a mesh.
std::vector<EdgeStencil> edge_stencils(std::size_t vertices, std::span<const Triangle> triangles,
                                       const MeshEdges& edges, std::span<const std::uint32_t> wanted);

// How far a new vertex is moved off the middle of its edge, in eighths of what either rule says. Both interpolate.
struct SubdivisionRule {
    // The butterfly of Dyn, Levin and Gregory (1990), which sees eight vertices as if they were evenly spread; along a
    // border the four-point rule.
    std::uint32_t butterfly = 0;
    // Half-way along the cubic that leaves both ends in their tangent planes, as in PN triangles (Vlachos et al. 2001).
    // It sees the ends' normals alone, whatever is around them.
    std::uint32_t tangents = 8;
    bool operator==(const SubdivisionRule&) const = default;
};

// Sixteen times what butterfly moves a new vertex off its edge's middle; exact.
std::array<std::int64_t, 3> butterfly_offset(std::span<const LatticePoint> positions, const EdgeStencil& stencil);
// What the tangent planes at its ends move it by. normals: of unit length or zero, one per vertex.
Vector3d tangents_offset(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                         const EdgeStencil& stencil);
// Where a new vertex is expected.
Vector3d expected_vertex(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                         const EdgeStencil& stencil, const SubdivisionRule& rule);

// Where a vertex comes to lie that is displaced along its normal, by so many lattice units.
LatticePoint displaced_vertex(const Vector3d& expected, const Vector3d& normal, double displacement);

struct SubdivisionLevel {
    std::uint32_t first = 0;            // the number of its first new vertex
    std::vector<EdgeStencil> stencils;  // of each new vertex
    // The new vertices before it on the other sides of the triangles beside its edge, or no_element.
    std::vector<std::array<std::uint32_t, 4>> beside;
    std::vector<Triangle> triangles;    // after it
    std::vector<std::uint32_t> parent;  // of each triangle, which one it was cut from
};

struct SubdivisionDepth {
    std::uint32_t levels = 3;  // how often edges are split, 0..most_levels
    // An edge that is longer is split to make the last level, > 0, lattice units; one twice as long to make the last
    // but one, and so on: levels come first where the base is coarse, and all triangles of the finest are about as
    // large.
    std::uint32_t longest_edge = 160;
};
inline constexpr std::uint32_t most_levels = 8;

// Adds a level's vertices behind those before it: each where the rule expects it, and as far off that along its normal.
// triangles: before the level. displacements: of each new vertex.
void add_vertices(const SubdivisionLevel& level, const SubdivisionRule& rule, std::span<const Triangle> triangles,
                  std::span<const double> displacements, std::vector<LatticePoint>& positions, Threads threads);

// All levels of a base mesh. They follow from the base alone, not from how its surface is moved: lengths are those on
// the base's flat triangles. Where two sides of a triangle are split, the quadrangle that remains is cut along its
// diagonal that is shorter there. Triangles follow in the order of those that they are cut from. base: on the lattice,
// indices in range. finest: if given, set to the edges of the last level. Nothing if there would be more vertices than
// these.
std::optional<std::vector<SubdivisionLevel>> subdivide(const LatticeMesh& base, const SubdivisionDepth& depth,
                                                       std::size_t most_vertices, MeshEdges* finest = nullptr);

// The places of these vertices, and with add_middles() of a level's behind them, in the middles of their edges.
std::vector<Vector3d> places_of(std::span<const LatticePoint> positions);
void add_middles(const SubdivisionLevel& level, std::vector<Vector3d>& places);

// One level more, which splits the edges that are said. edges: of the triangles. split: one per edge, 1 or 0. places:
// of the vertices; where two sides of a triangle are split, they say along which diagonal it is cut. next: if given,
// set to the level's edges. Nothing if there would be more vertices than these.
std::optional<SubdivisionLevel> split_edges(std::span<const Vector3d> places, std::span<const Triangle> triangles,
                                            const MeshEdges& edges, std::span<const std::uint8_t> split,
                                            std::size_t most_vertices, MeshEdges* next = nullptr);

// Which edges the tangent planes' rule moves off their middle by so much or more: 1; else 0. normals: of unit length or
// zero, one per vertex.
std::vector<std::uint8_t> bent_edges(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                     const MeshEdges& edges, double least);

}  // namespace htvm::internal
