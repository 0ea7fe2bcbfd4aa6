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
    double lambda = 0.12;  // squared steps that a bit must spare
    int rounds = 5;        // of the fit
    SurfaceFitOptions fit;
};

struct EncodedSurfaceLevels {
    std::vector<std::uint8_t> run;
    LeveledSurface surface;  // that the decoder will have
    struct Part {
        std::size_t vertices = 0, moved = 0;
        double bytes = 0;
    };
    std::vector<Part> parts;  // the base's displacements, then each level's
};

// captured: with a grid for searches by direction. base: decoded.
EncodedSurfaceLevels encode_surface_levels(const SurfaceIndex& captured, const LatticeMesh& base,
                                           const SurfaceLevelsOptions& options);

}  // namespace htvm::internal
