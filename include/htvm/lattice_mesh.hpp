// A mesh in the codec's own form: integers only, so that encoder and decoder agree to the bit (docs/bitstream.md,
// section 1). This is also what a plugged-in static coder codes.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm {

// Lattice coordinates, in steps of 2^-lattice_bits mm. |x|, |y|, |z| <= lattice_limit for every decoded vertex, so that
// a difference fits in 26 bits and a squared distance is an exact int64 (and an exact double).
struct LatticePoint {
    std::int32_t x = 0, y = 0, z = 0;
    auto operator<=>(const LatticePoint&) const = default;
};

inline constexpr std::int32_t lattice_limit = 1 << 24;

using QuantisedNormal = std::array<std::int32_t, 3>;    // each component times 127, rounded
using QuantisedTexcoord = std::array<std::int32_t, 2>;  // each component times 4096, rounded

// Attributes have one entry per vertex, or none at all; triangles index existing vertices.
struct LatticeMesh {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
    std::vector<QuantisedNormal> normals;
    std::vector<QuantisedTexcoord> texcoords;
};

}  // namespace htvm
