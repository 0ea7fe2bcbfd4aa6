// Counts of a mesh's elements, and of the damage that a codec may do to it: cracks and flaps.
//
// Counts by index take the mesh as it is stored. Cracks and flaps concern the visible surface: vertices at the same
// position count as one, so a surface cut along texture seams is whole.
#pragma once

#include <cstdint>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct TopologyMeasureOptions {
    bool defects = true;       // also look for cracks and flaps (slower than the counts)
    double crack_width = 0;    // mm, the widest gap that counts as a crack; 0: half of the mean edge length
    double flap_distance = 0;  // mm, the largest distance between two layers of a flap; 0: half of the mean edge length
};

struct Topology {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    std::uint64_t isolated_vertices = 0;     // in no triangle
    std::uint64_t degenerate_triangles = 0;  // with a repeated vertex, or without area
    std::uint64_t duplicate_triangles = 0;   // with the same three vertices as an earlier triangle, in any order
    std::uint64_t edges = 0;                 // pairs of different vertices that form a side of some triangle
    std::uint64_t boundary_edges = 0;        // of one triangle
    std::uint64_t non_manifold_edges = 0;    // of three or more triangles
    std::uint64_t components = 0;            // sets of triangles connected through vertices; isolated vertices are not
                                             // counted
    std::int64_t euler = 0;                  // used vertices - edges + triangles with three different vertices

    // For the surface with coincident vertices merged:
    std::uint64_t open_edges = 0;  // its boundary edges
    // A crack edge is an open edge whose midpoint lies within crack_width of another open edge that runs the opposite
    // way (their directions more than 135 degrees apart), on the side where the surface ends. Crack edges that share a
    // vertex or face each other form one crack. Its length is half the sum of the edges' lengths, since a crack has two
    // sides.
    std::uint64_t crack_edges = 0;
    std::uint64_t cracks = 0;
    double crack_length = 0;  // mm, of all cracks
    // A flap triangle has another layer of surface above or below it: from its centre, within flap_distance and steeply
    // (within 45 degrees of the normal), there is a triangle that shares no vertex with it and faces the same way
    // (normals within 45 degrees; the back of thin cloth or of a finger faces the other way). Flap triangles that share
    // a vertex or lie on top of each other form one flap. The area is that of all flap triangles, mm^2, so about twice
    // the doubled area.
    std::uint64_t flap_triangles = 0;
    std::uint64_t flaps = 0;
    double flap_area = 0;
};

// The same for any number of threads. A limit error if Embree runs out of memory.
Result<Topology> topology(const Mesh& mesh, const TopologyMeasureOptions& options = {}, internal::Threads threads = {});

}  // namespace htvm
