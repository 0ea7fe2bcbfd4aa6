// The colours of a surface's detail (codec/reference/surface_detail.h): what each vertex's colour differs from the mean
// of its edge's ends. Where a surface is plain nearly all of it is nothing, and costs a few hundredths of a bit; where
// it has a pattern the colours are as fine as the detail.
//
// Layer: the length of each coded level's run (varints), then the runs, of the first level first. Each is range-coded
// by itself; contexts go on from run to run.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/attribute_residual.h"
#include "codec/reference/surface_detail.h"
#include "entropy/mixing.h"
#include "entropy/models.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// In steps, of green, then of red and blue less that of green.
using ColourDifference = std::array<std::int32_t, 3>;

struct LevelColourModels {
    static constexpr std::size_t contrasts = 8, besides = 6, aboves = 4;
    // Whether other than zero.
    std::array<BinaryModel, contrasts * besides> by_beside{};
    std::array<BinaryModel, contrasts * aboves> by_above{};
    std::array<BinaryModel, besides * aboves> by_both{};
    Mixer<3> nonzero_mixer{};
    // The residuals of each component.
    std::array<std::array<ResidualContext, contrasts>, 3> by_contrast{};
    std::array<std::array<ResidualContext, besides * 3>, 3> by_before{};
    std::array<ResidualMantissa, 3> mantissa{};
};

// What is known round a vertex before its difference is coded, as classes.
struct LevelColourContext {
    std::size_t contrast = 0;  // how far its edge's ends differ
    std::size_t beside = 0;    // how large the differences beside it on its level are; 0: none is known
    std::size_t above = 0;     // how large those of its edge's ends are
};

// differences: of all vertices so far, those of the reference's zero. step: of colours.
LevelColourContext level_colour_context(const SubdivisionLevel& level, std::size_t i,
                                        std::span<const ColourDifference> differences, std::span<const Colour> colours,
                                        std::int32_t step);

// Codes a difference. Coder: as the coders of entropy/models.h.
template <class Coder>
ColourDifference code_level_colour(Coder& coder, LevelColourModels& m, const LevelColourContext& c,
                                   const ColourDifference& wanted) {
    using M = LevelColourModels;
    const std::array<BinaryModel*, 3> nonzero{&m.by_beside[c.contrast * M::besides + c.beside],
                                              &m.by_above[c.contrast * M::aboves + c.above],
                                              &m.by_both[c.beside * M::aboves + c.above]};
    ColourDifference out{};
    if (!code_mixed(coder, m.nonzero_mixer, nonzero, wanted != ColourDifference{})) return out;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t before = k == 0 || out[k - 1] == 0 ? 0 : out[k - 1] < 0 ? 1 : 2;
        out[k] = code_residual(coder, m.by_contrast[k][c.contrast], m.by_before[k][c.beside * 3 + before],
                               m.mantissa[k], wanted[k]);
    }
    return out;
}

// What a difference adds to a colour's levels.
std::array<std::int32_t, 3> levels_of(const ColourDifference& difference, std::int32_t step);

// Adds a level's vertices to the colours: the means of their edges' ends and these differences, in the order of its
// vertices.
Colour level_colour(const EdgeStencil& stencil, std::span<const Colour> colours, const ColourDifference& difference,
                    std::int32_t step);

// The vertices so far: those of the reference, then the detail's.
struct LevelColours {
    std::vector<Colour> all;
    std::vector<ColourDifference> differences;
    explicit LevelColours(std::span<const Colour> of_reference)
        : all(of_reference.begin(), of_reference.end()), differences(of_reference.size()) {}
};

// Codes the colours of one level of the detail, and adds them to both. choose(stencil, context) gives the difference
// that is wanted; decoding, anything.
template <class Coder, class Choose>
void code_level_colours(Coder& coder, LevelColourModels& models, std::size_t number, std::int32_t step,
                        LevelColours& colours, SurfaceDetail& detail, const Choose& choose) {
    const auto& level = detail.levels[number];
    for (std::size_t i = 0; i < level.stencils.size(); ++i) {
        const auto& stencil = level.stencils[i];
        const auto context = level_colour_context(level, i, colours.differences, colours.all, step);
        const auto difference = code_level_colour(coder, models, context, choose(stencil, context));
        colours.differences.push_back(difference);
        colours.all.push_back(level_colour(stencil, colours.all, difference, step));
        detail.colours.push_back(levels_of(difference, step));
    }
}

// The layer of these runs.
std::vector<std::uint8_t> write_level_colours(std::span<const std::vector<std::uint8_t>> runs);

// How long each run is, and where the first begins in the layer. Errors: corrupt_stream.
struct LevelColourRuns {
    std::array<std::uint64_t, most_levels> sizes{};
    std::size_t first = 0;
};
Result<LevelColourRuns> level_colour_runs(std::span<const std::uint8_t> layer, std::size_t coded);

// Sets detail.colours, of its first levels, from the layer. colours: of the reference's vertices. coded: how many
// levels are. Errors: corrupt_stream.
Result<void> decode_level_colours(std::span<const std::uint8_t> layer, std::span<const Colour> colours,
                                  std::int32_t step, std::size_t coded, SurfaceDetail& detail);

}  // namespace htvm::internal
