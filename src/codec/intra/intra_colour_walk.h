// What encoder and decoder of intra colours share: the walk over the vertices, the prediction of each and the contexts
// of its residual. Integers throughout; predictions and magnitudes are in sixteenths of a level.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/intra/attribute_residual.h"
#include "codec/intra/intra_neighbours.h"
#include "core/lattice.h"

namespace htvm::internal {

// How the layer predicts; sent in its first four bytes.
struct ColourPredictor {
    std::int8_t red_from_green = 64, blue_from_green = 64, blue_from_red = 0;  // 1/64
    std::uint8_t decoded_weight = 16;                                          // 1/16, 1..16
};

inline constexpr std::array<std::size_t, 3> colour_order{1, 0, 2};  // green, red, blue: the components as coded

using ColourLevels = std::array<std::int32_t, 3>;  // in coding order, sixteenths of a level

// By vertex, what is known of it.
struct ColourHistory {
    explicit ColourHistory(std::size_t vertex_count) : level(vertex_count), miss(vertex_count) {}
    std::vector<std::array<std::int16_t, 3>> level;  // that others are predicted from
    std::vector<std::array<std::int16_t, 3>> miss;   // how far its own prediction was
};

// The prediction of a vertex, and how restless its surroundings are.
struct ColourSurroundings {
    ColourLevels predicted{}, spread{}, miss{};
};

ColourSurroundings colour_surroundings(std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                       std::size_t rank, const ColourHistory& history);

// The contexts of the residuals, their classes scaled to the step.
class ColourContexts {
public:
    explicit ColourContexts(std::int32_t step);
    ResidualContext& by_activity(std::size_t component, std::int32_t activity) {
        return activity_[component][class_of(activity, fine_)];
    }
    // before: the spread for the first component, else how far the component before was off.
    ResidualContext& by_components(std::size_t component, std::int32_t before, std::int32_t miss) {
        return components_[component]
                          [class_of(before, component == 0 ? coarse_ : middle_) * classes + class_of(miss, coarse_)];
    }
    ResidualMantissa& mantissa(std::size_t component) { return mantissa_[component]; }

private:
    static constexpr std::size_t classes = 12;
    using Thresholds = std::array<std::int32_t, classes - 1>;
    static std::size_t class_of(std::int32_t value, const Thresholds& thresholds) {
        std::int32_t k = 0;  // counted without an early way out: it is faster than a branch that is hard to predict
        for (const std::int32_t threshold : thresholds) k += value > threshold;
        return static_cast<std::size_t>(k);
    }
    Thresholds fine_{}, middle_{}, coarse_{};
    std::array<std::array<ResidualContext, classes>, 3> activity_;
    std::array<std::array<ResidualContext, classes * classes>, 3> components_;
    std::array<ResidualMantissa, 3> mantissa_;
};

// Codes the vertex at `rank`. code(context, context, mantissa, offset) puts offset (the original less its prediction,
// in levels, times the side on which the prediction was rounded) into the stream, quantised, and returns the quantised
// number; decoding, it returns what the stream says. The colour is then set from what was returned.
template <class Code>
void code_colour(std::vector<Colour>& colours, std::span<const LatticePoint> positions, const Neighbours& neighbours,
                 std::size_t rank, const ColourPredictor& predictor, std::int32_t step, ColourHistory& history,
                 ColourContexts& contexts, Code&& code) {
    const std::uint32_t vertex = neighbours.order[rank];
    const ColourSurroundings around = colour_surroundings(positions, neighbours, rank, history);
    ColourLevels off{};
    for (std::size_t k = 0; k < 3; ++k) {
        std::int32_t at = around.predicted[k];
        if (k == 1) at += (predictor.red_from_green * off[0] + 32) >> 6;
        if (k == 2) at += (predictor.blue_from_green * off[0] + predictor.blue_from_red * off[1] + 32) >> 6;
        at = std::clamp(at, 0, 16 * 255);
        const std::int32_t nearest = (at + 8) >> 4;
        // Mirrored so that the prediction is always rounded downwards: one context learns both sides.
        const std::int32_t side = at < 16 * nearest ? -1 : 1;
        std::uint8_t& level = colours[vertex][colour_order[k]];
        const std::int32_t activity = k == 0 ? (10 * around.miss[0] + 10 * around.spread[0]) / 16
                                             : (11 * around.miss[k] + 4 * around.spread[k]) / 16;
        const std::int32_t before = k == 0 ? around.spread[0] : std::abs(off[k - 1]);
        const std::int64_t quantised =
            code(contexts.by_activity(k, activity), contexts.by_components(k, before, around.miss[k]),
                 contexts.mantissa(k), side * (level - nearest));
        level = static_cast<std::uint8_t>(std::clamp<std::int64_t>(nearest + side * quantised * step, 0, 255));
        off[k] = 16 * level - around.predicted[k];
        history.miss[vertex][k] = static_cast<std::int16_t>(std::abs(16 * level - at));
        history.level[vertex][k] = static_cast<std::int16_t>(at + predictor.decoded_weight * (16 * level - at) / 16);
    }
}

}  // namespace htvm::internal
