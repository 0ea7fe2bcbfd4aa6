// Triangles that follow the surface: each once, all wound alike. Exporters write every triangle once for each side,
// merged sensors and greedy triangulations wind them as they come; whatever asks which way a surface faces is lost
// there.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/lattice.h"

namespace htvm::internal {

struct CleanedTriangles {
    std::vector<Triangle> triangles;  // in the order in which they came
    std::size_t doubled = 0;          // left out, as one with the same corners came before
    std::size_t turned = 0;           // wound the other way round than they came
};

// Corners at one place are one, whatever their vertices: seams join. Of triangles with the same corners the first
// stays. Neighbours across an edge that two triangles share are wound alike; each connected piece as the larger part of
// its area was, or, where that is in doubt or sides were doubled, so that it faces away from its own middle.
CleanedTriangles clean_triangles(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

// Whether so many are doubled or turned that a capture's triangles are better cleaned: 1 % of them. Fewer are odd spots
// that any scan has.
bool needs_cleaning(const CleanedTriangles& cleaned, std::size_t triangles);

}  // namespace htvm::internal
