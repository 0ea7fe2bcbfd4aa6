// Removal of duplicate vertices (paper, section IV-C2): vertices that decode to the same point and attributes merge. I-
// and EP-frames do this before their layers are coded; simplified references weld by the same code.
#pragma once

#include <cstdint>
#include <vector>

#include "core/lattice.h"

namespace htvm::internal {

struct Merging {
    std::vector<std::uint32_t> kept;    // the vertices that stay, ascending: of equal ones the first
    std::vector<std::uint32_t> number;  // for every vertex, the place in `kept` of the one that stands for it
};

// Vertices with the same position and the same of every attribute that the mesh has.
Merging find_duplicates(const LatticeMesh& mesh);
// Everything stays.
Merging no_duplicates(std::size_t vertices);

// Re-indexes the triangles; those with two corners in one vertex are dropped where `drop_collapsed` is set.
std::vector<Triangle> merged_triangles(const std::vector<Triangle>& triangles, const Merging& merging,
                                       bool drop_collapsed);
// The vertices that stay; triangles are left empty.
LatticeMesh kept_vertices(const LatticeMesh& mesh, const std::vector<std::uint32_t>& kept);

}  // namespace htvm::internal
