// Removes duplicate vertices (paper, section IV-C2): vertices that decode to the same point and attributes are merged.
// I- and EP-frames do this before their layers are coded; simplified references are welded by the same code.
#pragma once

#include <cstdint>
#include <vector>

#include "core/lattice.h"

namespace htvm::internal {

struct Merging {
    std::vector<std::uint32_t> kept;    // the vertices that are kept, ascending: the first of each set of equals
    std::vector<std::uint32_t> number;  // for every vertex, the place in `kept` of the vertex that replaces it
};

// Finds vertices that agree in position and in every attribute that the mesh has.
Merging find_duplicates(const LatticeMesh& mesh);
// Keeps every vertex.
Merging no_duplicates(std::size_t vertices);

// Re-indexes the triangles; with `drop_collapsed`, those with two corners in one vertex are dropped.
std::vector<Triangle> merged_triangles(const std::vector<Triangle>& triangles, const Merging& merging,
                                       bool drop_collapsed);
// The vertices that are kept; without triangles.
LatticeMesh kept_vertices(const LatticeMesh& mesh, const std::vector<std::uint32_t>& kept);

// Which vertices are at the same place. Merged into one, with the colour of the first: else the two sides of a seam, as
// of a texture chart, would be simplified, or cut, separately, and gaps would open. Triangles keep their order.
Merging at_same_place(const LatticeMesh& captured);
LatticeMesh welded(const LatticeMesh& captured, const Merging& same_place);

}  // namespace htvm::internal
