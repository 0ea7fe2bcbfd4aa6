// A mesh as the codec holds it: integers only, so that encoder and decoder agree to the bit (docs/bitstream.md,
// section 1). What a static coder that is plugged in packs and unpacks.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm {

// Lattice coordinates. The lattice step is 2^-lattice_bits mm. |x|, |y|, |z| <= lattice_limit for every decoded
// vertex, so that a difference fits 26 bits and a squared distance is an exact int64 (and an exact double).
struct LatticePoint {
    std::int32_t x = 0, y = 0, z = 0;
    auto operator<=>(const LatticePoint&) const = default;
};

inline constexpr std::int32_t lattice_limit = 1 << 24;

using QuantisedNormal = std::array<std::int32_t, 3>;    // each component times 127, rounded
using QuantisedTexcoord = std::array<std::int32_t, 2>;  // each component times 4096, rounded

// Attributes have one entry a vertex, or none at all; triangles name vertices that are there.
struct LatticeMesh {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
    std::vector<QuantisedNormal> normals;
    std::vector<QuantisedTexcoord> texcoords;
};

}  // namespace htvm
