// Meshes to and from the lattice on which the codec works.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// Where lattice coordinates lie in space: millimetres = origin + coordinates * 2^-bits.
struct Lattice {
    std::array<std::int32_t, 3> origin{};  // mm
    int bits = 4;                          // 0..16
    double step() const { return 1.0 / static_cast<double>(1 << bits); }
};

// The origin for a sequence that begins with this mesh: the middle of its bounding box, in whole millimetres.
Result<std::array<std::int32_t, 3>> lattice_origin(const Mesh& mesh);

// Every vertex rounded to the nearest lattice point, attributes to their integers. Errors: a position, normal or
// texture coordinate that is not finite or too far away, a triangle index out of range, an attribute array of
// another length than positions (bad_input, with the first offender named).
Result<LatticeMesh> to_lattice(const Mesh& mesh, const Lattice& lattice);
Result<LatticePoint> to_lattice(const std::array<double, 3>& point, const Lattice& lattice);

// Parts of a mesh as it is shown, in floats, into arrays that may have been used before: positions in millimetres,
// normals of unit length (of no length, where they have none), texture coordinates as they were captured.
void to_millimetres(std::span<const LatticePoint> positions, const Lattice& lattice, std::vector<Vector3f>& out);
void to_unit_normals(std::span<const QuantisedNormal> normals, std::vector<Vector3f>& out);
void to_texcoords(std::span<const QuantisedTexcoord> texcoords, std::vector<Vector2f>& out);
// All of it.
Mesh to_mesh(const LatticeMesh& mesh, const Lattice& lattice);
std::array<double, 3> to_millimetres(LatticePoint point, const Lattice& lattice);

}  // namespace htvm::internal
