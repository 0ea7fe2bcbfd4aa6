#include "codec/intra/intra_colour_walk.h"

namespace htvm::internal {

ColourContexts::ColourContexts(std::int32_t step) {
    // Classes of a magnitude in quarters of a level at step 1; a coarser step widens them.
    static constexpr Thresholds quarters{2, 4, 6, 12, 20, 32, 52, 80, 160, 320, 800};  // in eighths
    for (std::size_t i = 0; i < quarters.size(); ++i) {
        const std::int32_t sixteenths = 2 * quarters[i];
        fine_[i] = step == 1 ? sixteenths / 4 : sixteenths * step * 3 / 20;
        coarse_[i] = sixteenths * step / 4;
        middle_[i] = sixteenths * step / 3;
    }
}

ColourSurroundings colour_surroundings(std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                       std::size_t rank, const ColourHistory& history) {
    ColourSurroundings out;
    const auto around = neighbours.neighbours_of(rank);
    if (around.empty()) {
        for (std::size_t k = 0; k < 3; ++k)
            out.predicted[k] = rank == 0 ? 16 * 128 : history.level[neighbours.order[rank - 1]][k];
        return out;
    }
    // Weights fall with the squared distance; a squared distance is below 2^53, the sum of the weights below 2^44.
    std::array<std::int64_t, row_limit> weight{};
    std::int64_t sum = 0;
    const LatticePoint here = positions[neighbours.order[rank]];
    for (std::size_t i = 0; i < around.size(); ++i) {
        weight[i] = (std::int64_t{1} << 40) / (squared_distance(positions[around[i]], here) + 1) + 1;
        sum += weight[i];
    }
    std::int32_t left = 1 << 14;  // the normalised weights sum to 2^14
    std::array<std::int32_t, row_limit> share{};
    for (std::size_t i = 1; i < around.size(); ++i) {
        share[i] = static_cast<std::int32_t>((weight[i] << 14) / sum);
        left -= share[i];
    }
    share[0] = left;
    for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            out.predicted[k] += share[i] * history.level[around[i]][k];
            out.miss[k] += share[i] * history.miss[around[i]][k];
        }
    for (std::size_t k = 0; k < 3; ++k) {
        out.predicted[k] = (out.predicted[k] + (1 << 13)) >> 14;
        out.miss[k] >>= 14;
    }
    for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            out.spread[k] += share[i] * std::abs(history.level[around[i]][k] - out.predicted[k]);
    for (auto& spread : out.spread) spread >>= 14;
    return out;
}

}  // namespace htvm::internal
