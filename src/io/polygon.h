// Polygons as triangles. Readers cut each polygon into the fan around its first corner as they meet it, when positions
// need not be known yet. Fans of convex polygons stay; those that fold over are cut anew once the mesh is whole.
#pragma once

#include <cstdint>
#include <span>

#include "htvm/mesh.hpp"

namespace htvm {

// The triangles of a polygon that has two corners more: corners 0 1 2, 0 2 3 and so on.
struct Fan {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;
};

// Cuts anew, in their place, the fans with a triangle that faces away from its polygon: of concave polygons the ears
// are cut off one by one, in the plane that the polygon faces on the whole; of a quad the other diagonal is taken.
// Polygons without such a cut (those that cross themselves, have no area or are not finite) keep their fan, and so do
// the polygons that are left when a mesh takes more than a bounded time.
void mend_fans(Mesh& mesh, std::span<const Fan> fans);

}  // namespace htvm
