// Which point of a decoded surface each vertex of the captured one is.
//
// The nearest point is not it where two surfaces lie close: a finger on a ball, cloth on cloth, the two sides of a thin
// shell. So a match faces as its vertex does, and it continues those of the vertices around: from a match that is sure,
// the surface is followed to the next vertex, and where that leads about as near as anything does, it is where the
// vertex belongs.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"

namespace htvm {

struct SurfaceMatch {
    static constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t triangle = nothing;  // of the decoded surface
    std::array<float, 3> shares{};     // weights of its corners
    float distance = 0;                // in the unit of the positions
    float doubt = 0;                   // the distance, and more where the two surfaces face different ways: of several
                                       // captured points that come to lie on one, the least doubtful is it
    bool found() const { return triangle != nothing; }
};

struct MatchedSurface {
    std::span<const Vector3f> positions;
    std::span<const Triangle> triangles;
    std::span<const std::array<std::uint32_t, 3>> beside;  // the triangle across each edge, from corner i to i + 1
};

// Triangles across each edge; SurfaceMatch::nothing where there is none. Where more than two are at an edge, the first
// two are beside each other, and the next two.
std::vector<std::array<std::uint32_t, 3>> triangles_beside(std::span<const Triangle> triangles);

// One for each captured vertex; nothing where none lies within reach. All numbers must be in range, positions finite.
std::vector<SurfaceMatch> surface_matches(const Mesh& captured, const MatchedSurface& decoded, double reach,
                                          internal::Threads threads);

}  // namespace htvm
