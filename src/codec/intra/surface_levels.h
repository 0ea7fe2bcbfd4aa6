// The finer levels of a surface: a base mesh is subdivided, and each new vertex is moved from where it is expected,
// along its normal, by what is coded for it. The base's own vertices are moved first, so that they may be coded
// coarsely. What is expected follows from the decoded levels above, so no error adds up from level to level.
//
// Where the surface is smooth a vertex costs a few hundredths of a bit: connectivity is not coded at all, and most
// displacements are zero in contexts that say so.
//
// Payload: a header, then the run of the base's displacements, then one of each level's in the order of its edges. The
// header says how long each run is, so a payload may be cut behind any, and what is left gives the levels up to there.
// Contexts go on from run to run.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/subdivision.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr int displacement_bits = 4;  // of the fraction of displacements' steps

struct SurfaceLevels {
    SubdivisionDepth depth;
    std::uint32_t step = 256;    // of the finest level's displacements, in sixteenths of lattice units, 1..2^20
    std::uint32_t coarser = 12;  // a level's step in sixteenths of that of the level below, 1..16
    // Behind the levels that are coded another may follow that only rounds off what is bent: edges that the tangent
    // planes' rule moves off their middle by so many 32nds of the step or more are split, and nothing is displaced. 0:
    // there is none.
    std::uint32_t rounded = 0;                             // 0..255
    std::array<SubdivisionRule, most_levels + 1> rules{};  // of each level, and of the one that rounds off
};

// The step at a level, of 0 for the base to `levels`, in sixteenths of lattice units.
std::uint32_t step_at(const SurfaceLevels& levels, std::uint32_t level);

// How far a quantised displacement moves a vertex, in lattice units.
inline double displacement_of(std::int32_t value, std::uint32_t step) {
    return static_cast<double>(value) * static_cast<double>(step) / (1 << displacement_bits);
}

// A surface as it is decoded.
struct LeveledSurface {
    std::vector<LatticePoint> positions;        // the base's vertices first, then each level's
    std::vector<Triangle> triangles;            // of the base
    std::vector<SubdivisionLevel> subdivision;  // its levels, the one that rounds off last
    std::vector<double> displacements;          // of each vertex, along its normal, in lattice units
    // The triangles of the level above one, which is 1 to one more than there are.
    const std::vector<Triangle>& triangles_above(std::size_t level) const {
        return level < 2 ? triangles : subdivision[level - 2].triangles;
    }
    const std::vector<Triangle>& finest() const { return triangles_above(subdivision.size() + 1); }
};

// What a payload's header says.
struct SurfaceLevelsHeader {
    SurfaceLevels levels;
    // Where the run of the base's displacements begins in the payload, and where that of each level ends, the base's
    // first.
    std::size_t first_run = 0;
    std::array<std::size_t, most_levels + 1> ends{};
};

// Errors: corrupt_stream if the header is cut off, its numbers are out of range, or bytes follow the last run. Runs may
// be missing.
Result<SurfaceLevelsHeader> read_levels_header(std::span<const std::uint8_t> payload);

// The surface that was encoded, down to a level, or to the finest if there are fewer: 0 gives the base, moved. The
// vertices of these levels lie where they lie in the whole surface; what comes behind their runs is not read, and may
// be missing. The level that rounds off is the one behind those that are coded. base: its positions are on the lattice,
// its indices in range. most_vertices: of the level asked for. Errors: those of the header; corrupt_stream if a run is
// cut off; limit if there would be more vertices.
Result<LeveledSurface> decode_surface_levels(std::span<const std::uint8_t> payload, const LatticeMesh& base,
                                             std::size_t most_vertices, std::uint32_t down_to = most_levels + 1);

}  // namespace htvm::internal
