// Where a surface ends: the edges of a single triangle, and what lies on them.
//
// Vertices at the same position count as one, so that seams of textures are no borders, and triangles on the same three
// places as one, so that a sheet with two sides ends where it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry.h"
#include "htvm/mesh.hpp"

namespace htvm {

class SurfaceBorder {
public:
    explicit SurfaceBorder(const Mesh& mesh);

    // Whether a point of a triangle, given by the corners' shares of it (core/geometry.h), lies on the border.
    bool has(std::uint32_t triangle, const Vector3d& shares) const;

    std::size_t edges() const { return edges_; }
    std::size_t border_edges() const { return border_edges_; }

private:
    std::vector<std::uint8_t> of_triangles_;  // bits 0..2: the side from this corner to the next; 3..5: the corner
    std::size_t edges_ = 0, border_edges_ = 0;
};

// A view of somebody, as a depth camera delivers it: more than a percent of the edges are borders. A scan that is open
// at the feet, or has a few holes, is none.
bool is_open(const Mesh& mesh);

}  // namespace htvm
