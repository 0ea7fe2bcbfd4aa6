// The integer lattice on which every decoded position lives (design, section 5): exact on every machine.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/exact_arithmetic.h"
#include "htvm/lattice_mesh.hpp"

namespace htvm::internal {

inline LatticePoint operator+(LatticePoint a, LatticePoint b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline LatticePoint operator-(LatticePoint a, LatticePoint b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

inline bool on_lattice(LatticePoint p) {
    auto inside = [](std::int32_t c) { return c >= -lattice_limit && c <= lattice_limit; };
    return inside(p.x) && inside(p.y) && inside(p.z);
}

// The nearest coordinate that is on the lattice.
inline std::int32_t within_lattice(std::int64_t c) {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(c, -std::int64_t{lattice_limit}, std::int64_t{lattice_limit}));
}

// Squared Euclidean distance in lattice units, exact.
inline std::int64_t squared_distance(LatticePoint a, LatticePoint b) {
    const std::int64_t dx = std::int64_t{a.x} - b.x, dy = std::int64_t{a.y} - b.y, dz = std::int64_t{a.z} - b.z;
    return dx * dx + dy * dy + dz * dz;
}

// Quotient rounded to the nearest integer, halves away from zero; denominator > 0.
inline std::int64_t divide_rounded(std::int64_t numerator, std::int64_t denominator) {
    const std::int64_t half = denominator / 2;
    return numerator >= 0 ? (numerator + half) / denominator : -((-numerator + half) / denominator);
}

}  // namespace htvm::internal
