// Makes an extracted surface look like a reconstruction: the wanted number of vertices, well-shaped triangles, and no
// trace of the grid that it was extracted over.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm::synth {

// A closed oriented manifold. Half-edge 3 t + c runs from corner c of triangle t to the next corner.
struct HalfEdgeMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::uint32_t> origin;    // vertex that each half-edge leaves; dead_half_edge in collapsed triangles
    std::vector<std::uint32_t> twin;      // the half-edge that runs the other way
    std::vector<std::uint32_t> outgoing;  // a half-edge that leaves each vertex; dead_half_edge for collapsed vertices
    std::vector<std::uint32_t> valence;   // valence of each vertex
};
inline constexpr std::uint32_t dead_half_edge = 0xffffffffu;

// Builds the mesh without components of fewer than `fewest` triangles; their vertices stay as dead ones. The result has
// no half-edges if the triangles are not a closed oriented manifold.
HalfEdgeMesh build_half_edges(const std::vector<Eigen::Vector3d>& positions, const std::vector<Triangle>& triangles,
                              std::size_t fewest);

// Whether moving a live vertex would turn one of its triangles by more than about 70 degrees.
bool would_fold(const HalfEdgeMesh& mesh, std::uint32_t vertex, const Eigen::Vector3d& place);

// Collapses the shortest edges first, until `vertices` are left or no edge can be collapsed without folding the surface
// or making it non-manifold.
void collapse_to(HalfEdgeMesh& mesh, std::size_t vertices);

// Flips edges until the two angles opposite to every edge sum to at most 180 degrees (locally Delaunay), unless a flip
// would fold the surface.
void flip_to_delaunay(HalfEdgeMesh& mesh);

// Area-weighted unit normals; zero for dead vertices.
std::vector<Eigen::Vector3d> vertex_normals(const HalfEdgeMesh& mesh, internal::Threads threads);

// Moves every vertex along the surface by `share` of the way to the mean of its neighbours.
void relax(HalfEdgeMesh& mesh, double share, internal::Threads threads);

// Removes dead elements and renumbers the rest.
void compact(HalfEdgeMesh& mesh);

// The triangles of a compact mesh.
std::vector<Triangle> triangles_of(const HalfEdgeMesh& mesh);

}  // namespace htvm::synth
