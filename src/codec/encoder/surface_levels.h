// Finds what surface levels say of a captured surface: where the vertices of each level come to lie on it, and what of
// that is worth its bits.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/encoder/surface_levels_fit.h"
#include "codec/intra/surface_levels.h"
#include "core/lattice.h"
#include "surface/surface_index.h"

namespace htvm::internal {

struct SurfaceLevelsOptions {
    SurfaceLevels levels;
    double lambda = 0.06;  // squared steps that a bit must spare
    int rounds = 4;        // of the fit, before the first level is coded
    SurfaceFitOptions fit;
};

struct EncodedSurfaceLevels {
    std::vector<std::uint8_t> payload;
    LeveledSurface surface;  // that the decoder will have
    struct Part {
        std::size_t vertices = 0, moved = 0;  // and how many of them are displaced
        std::size_t bytes = 0;
    };
    std::vector<Part>
        parts;  // the base's displacements, then each level's; that of the one that rounds off has no bytes
};

// captured: evenly_sampled(). base: decoded, with triangles. Errors: limit if there would be too many vertices.
Result<EncodedSurfaceLevels> encode_surface_levels(const SurfaceIndex& captured, const LatticeMesh& base,
                                                   const SurfaceLevelsOptions& options);

}  // namespace htvm::internal
