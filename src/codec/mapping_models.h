// The contexts that mapping_enc.cpp and mapping_dec.cpp share.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "entropy/models.h"

namespace htvm {

// Walks the graph of Fig. 4 and picks the model for the bit c_q of the node it stands on.
class MappingContext {
public:
    // On the node of a reference vertex: will its residuals follow (c_q = 1) or the next reference vertex (0)?
    BinaryModel& at_reference() { return reference_[last_][before_last_][before_that_]; }
    // On the node of a residual, the n-th of its reference vertex (from 1): back to the other row (1) or one more (0)?
    BinaryModel& at_residual(std::uint32_t n) { return residual_[std::min<std::uint32_t>(n, 6) - 1][last_]; }
    // The reference vertex had n residuals; on to the next.
    void next(std::uint32_t n) {
        before_that_ = std::min<std::uint32_t>(before_last_, 2);
        before_last_ = last_;
        last_ = std::min<std::uint32_t>(n, 3);
    }

private:
    std::uint32_t last_ = 1, before_last_ = 1, before_that_ = 1;
    std::array<std::array<std::array<BinaryModel, 3>, 4>, 4> reference_;
    std::array<std::array<BinaryModel, 4>, 6> residual_;
};

}  // namespace htvm
