// The contexts of the mapping layer, shared by mapping_enc.cpp and mapping_dec.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "codec/paper/mapping.h"
#include "entropy/mixing.h"

namespace htvm::internal {

// Walks the graph of Fig. 4 and codes the bit c_q of the node it stands on.
class MappingContext {
public:
    explicit MappingContext(const MappingPrior& prior) : prior_(prior) {}
    // To reference vertex k; residuals_of holds the counts of those before it.
    void stand_on(std::size_t k, std::span<const std::uint32_t> residuals_of) {
        area_ = prior_.area_class[k];
        std::uint32_t known = 0;
        std::int32_t surplus = 0;
        for (std::uint32_t i = prior_.first_neighbour[k]; i < prior_.first_neighbour[k + 1]; ++i) {
            ++known;
            surplus += static_cast<std::int32_t>(std::min<std::uint32_t>(residuals_of[prior_.neighbours[i]], 3)) - 1;
        }
        known_ = std::min<std::uint32_t>(known, 7);
        surplus_ = static_cast<std::uint32_t>(std::clamp(surplus, -4, 4) + 4);
    }
    // The n-th decision at this vertex: from its node (n = 0), whether a residual follows (1) or the next reference
    // vertex (0); from its n-th residual's node, whether there is no further one (1) or one more (0).
    template <class Coder>
    bool code(Coder& coder, std::uint32_t n, bool wanted) {
        const std::uint32_t stage = std::min<std::uint32_t>(n, 5);
        return code_mixed(
            coder, mixers_[stage],
            std::array<BinaryModel*, 4>{&by_runs_[stage][last_][before_][before_that_], &by_area_[stage][area_][last_],
                                        &by_neighbours_[stage][known_][surplus_], &by_both_[stage][area_][surplus_]},
            wanted);
    }
    // The reference vertex had n residuals.
    void leave(std::uint32_t n) {
        before_that_ = std::min<std::uint32_t>(before_, 2);
        before_ = last_;
        last_ = std::min<std::uint32_t>(n, 3);
    }

private:
    const MappingPrior& prior_;
    std::uint32_t area_ = 0, known_ = 0, surplus_ = 4;
    std::uint32_t last_ = 1, before_ = 1, before_that_ = 1;
    std::array<Mixer<4>, 6> mixers_;
    std::array<std::array<std::array<std::array<BinaryModel, 3>, 4>, 4>, 6> by_runs_;
    std::array<std::array<std::array<BinaryModel, 4>, 10>, 6> by_area_;
    std::array<std::array<std::array<BinaryModel, 9>, 8>, 6> by_neighbours_;
    std::array<std::array<std::array<BinaryModel, 9>, 10>, 6> by_both_;
};

}  // namespace htvm::internal
