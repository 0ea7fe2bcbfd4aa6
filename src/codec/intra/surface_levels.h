// The finer levels of a surface: a base mesh is subdivided, and each new vertex is moved from where it is expected,
// along its normal, by what is coded for it. The base's own vertices are moved first, so that they may be coded
// coarsely. What is expected follows from the decoded levels above, so no error adds up from level to level.
//
// Where the surface is smooth a vertex costs a few hundredths of a bit: connectivity is not coded at all, and most
// displacements are zero in contexts that say so.
//
// Run: the header's numbers, then the displacements of the base's vertices, then those of each level in the order of
// its edges.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/subdivision.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr int displacement_bits = 4;  // of the fraction of displacements' steps

struct SurfaceLevels {
    SubdivisionDepth depth;
    std::uint32_t step = 256;    // of the finest level's displacements, in sixteenths of lattice units, 1..2^20
    std::uint32_t coarser = 12;  // a level's step in sixteenths of that of the level below, 1..16
    std::array<SubdivisionRule, most_levels> rules{};  // of each level
};

// The step at a level, of 0 for the base to `levels`, in sixteenths of lattice units.
std::uint32_t step_at(const SurfaceLevels& levels, std::uint32_t level);

// Where a vertex comes to lie that is displaced along its normal.
LatticePoint displaced_vertex(const Vector3d& expected, const Vector3d& normal, std::int32_t value, std::uint32_t step);

struct LeveledSurface {
    std::vector<LatticePoint> positions;  // the base's vertices first, then each level's
    std::vector<Triangle> triangles;
};

// The surface that was encoded. base: its positions are on the lattice, its indices in range. most_vertices: of the
// finest level. Errors: corrupt_stream if the run ends too early or its numbers are out of range; limit if there would
// be more vertices.
Result<LeveledSurface> decode_surface_levels(std::span<const std::uint8_t> run, const LatticeMesh& base,
                                             std::size_t most_vertices);

}  // namespace htvm::internal
