// Counts of what a mesh is made of, and of the damage that a codec may do to it: cracks and flaps.
//
// Counts by index take the mesh as it is stored. Cracks and flaps look at the surface as it is seen: vertices at the
// same position count as one, so that a surface cut along texture seams is whole.
#pragma once

#include <cstdint>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct TopologyMeasureOptions {
    bool defects = true;       // look for cracks and flaps too (slower than the counts)
    double crack_width = 0;    // mm, the widest gap that is a crack; 0: half of the mean edge length
    double flap_distance = 0;  // mm, the farthest apart that two layers of a flap are; 0: half of the mean edge length
};

struct Topology {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    std::uint64_t isolated_vertices = 0;     // in no triangle
    std::uint64_t degenerate_triangles = 0;  // a vertex twice, or no area
    std::uint64_t duplicate_triangles = 0;   // the same three vertices as an earlier triangle, in any order
    std::uint64_t edges = 0;                 // pairs of different vertices that are a side of some triangle
    std::uint64_t boundary_edges = 0;        // of one triangle
    std::uint64_t non_manifold_edges = 0;    // of three or more triangles
    std::uint64_t components = 0;            // sets of triangles connected through vertices; isolated ones not counted
    std::int64_t euler = 0;                  // used vertices - edges + triangles with three different vertices

    // Of the surface with coincident vertices made one:
    std::uint64_t open_edges = 0;  // its boundary edges
    // A crack edge is an open edge whose middle lies within crack_width of another open edge that runs the other way
    // (their directions over 135 degrees apart) on the side where the surface ends. Crack edges that share a vertex
    // or face each other make one crack; the length is half the sum of the edges', as a crack has two sides.
    std::uint64_t crack_edges = 0;
    std::uint64_t cracks = 0;
    double crack_length = 0;  // mm, of all
    // A flap triangle has another layer of surface over or under it: from its centre, within flap_distance and
    // steeply (within 45 degrees of the normal), comes a triangle that shares no vertex with it and faces the same way
    // (normals within 45 degrees; the back of thin cloth or of a finger faces the other way). Flap triangles that share
    // a vertex or lie over each other make one flap. The area is that of all flap triangles, mm^2, so about twice the
    // doubled area.
    std::uint64_t flap_triangles = 0;
    std::uint64_t flaps = 0;
    double flap_area = 0;
};

// The same for any number of threads. A limit error where Embree runs out of memory.
Result<Topology> topology(const Mesh& mesh, const TopologyMeasureOptions& options = {}, internal::Threads threads = {});

}  // namespace htvm
