// Where a captured surface ends. A depth camera's has a border wherever something stood in the way: beyond it nothing
// is known, and a point that lies nearest to it says nothing of the surface. Encoder only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

inline constexpr std::uint8_t far_from_border = 3;

// Says of each vertex how many edges lead to the nearest border, at most far_from_border; that of vertices of no
// triangle. Vertices at the same place count as one, so the seams of a texture are no borders; how triangles face does
// not matter. Linear in vertices and triangles.
std::vector<std::uint8_t> edges_from_border(std::span<const Vector3f> positions, std::span<const Triangle> triangles);

// The share of the vertices that lie on a border, of those that have triangles: next to 0 for captures from all sides,
// 0.03 to 0.2 for views of depth cameras.
double share_on_border(std::span<const Vector3f> positions, std::span<const Triangle> triangles);

enum class Openness : std::uint8_t { closed, bordered, in_pieces };

// What a capture is that begins with this mesh: one of surface that comes and goes where it has borders, or is in
// pieces, as what a depth camera sees of a person is even if each piece was closed. Nothing else but people and what
// they hold comes in so many. positions: of any unit. Closed where triangles name vertices that do not exist.
Openness openness_of(std::span<const Vector3f> positions, std::span<const Triangle> triangles);

inline bool comes_and_goes(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    return openness_of(positions, triangles) != Openness::closed;
}

}  // namespace htvm::internal
