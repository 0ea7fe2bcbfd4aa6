// How one camera saw a frame's surface: where its points lie in the camera's film, which is the picture of the texture.
// Both sides derive texture coordinates from decoded positions, in doubles by + - x / alone, so that all decoders
// agree.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// Three rows of four numbers, each a weight of x, y and z, in lattice units, and a constant: the first two rows over
// the third give the place in the picture, (0, 0) being its lower left corner and (1, 1) its upper right one; the third
// is above 0 before the camera. All are finite.
struct FilmProjection {
    std::array<float, 12> rows{};
    bool operator==(const FilmProjection&) const = default;
};

bool is_finite(const FilmProjection& projection);

// Where these points lie, in 2^-16 of the picture, within 0 and 1. What is not before the camera has (0, 0).
void project(const FilmProjection& projection, std::span<const LatticePoint> positions,
             std::vector<QuantisedTexcoord>& out);

// The layer of an I-frame.
std::vector<std::uint8_t> write_projection_layer(const FilmProjection& projection);
// corrupt_stream if it has another size, or a number that is not finite.
Result<FilmProjection> read_projection_layer(std::span<const std::uint8_t> layer);

}  // namespace htvm::internal
