// The integer lattice on which every decoded position lives (docs/bitstream.md, section 1): exact arithmetic of its
// points, and conversion of meshes to and from it. The meshes are declared in htvm/lattice_mesh.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/exact_arithmetic.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline LatticePoint operator+(LatticePoint a, LatticePoint b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline LatticePoint operator-(LatticePoint a, LatticePoint b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

inline bool on_lattice(LatticePoint p) {
    auto inside = [](std::int32_t c) { return c >= -lattice_limit && c <= lattice_limit; };
    return inside(p.x) && inside(p.y) && inside(p.z);
}

// The nearest coordinate on the lattice.
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

// Where lattice coordinates are in space: millimetres = origin + coordinates * 2^-bits.
struct Lattice {
    std::array<std::int32_t, 3> origin{};  // mm
    int bits = 4;                          // 0..16
    double step() const { return 1.0 / static_cast<double>(1 << bits); }
};

// The origin for a sequence that begins with this mesh: the centre of its bounding box, in whole millimetres.
Result<std::array<std::int32_t, 3>> lattice_origin(const Mesh& mesh);

// Rounds every vertex to the nearest lattice point and attributes to integers. Errors (bad_input, naming the first
// offender): a position, normal or texture coordinate that is not finite or too large, a triangle index out of range,
// an attribute array whose length differs from that of the positions.
Result<LatticeMesh> to_lattice(const Mesh& mesh, const Lattice& lattice);
Result<LatticePoint> to_lattice(const std::array<double, 3>& point, const Lattice& lattice);

// Parts of a mesh as floats for display, written into arrays that may be reused: positions in millimetres, normals of
// unit length (zero where the mesh has none), texture coordinates, of which `unit` make 1.
inline constexpr double captured_texcoord_unit = 4096;
void to_millimetres(std::span<const LatticePoint> positions, const Lattice& lattice, std::vector<Vector3f>& out);
void to_unit_normals(std::span<const QuantisedNormal> normals, std::vector<Vector3f>& out);
void to_texcoords(std::span<const QuantisedTexcoord> texcoords, double unit, std::vector<Vector2f>& out);
// The whole mesh as floats.
Mesh to_mesh(const LatticeMesh& mesh, const Lattice& lattice, double texcoord_unit = captured_texcoord_unit);
std::array<double, 3> to_millimetres(LatticePoint point, const Lattice& lattice);

}  // namespace htvm::internal
