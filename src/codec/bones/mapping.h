// The mapping layer: which reference vertex each residual belongs to (paper, section IV-C3, Fig. 4).
//
// The path through the graph visits every reference vertex in order, and after each its residuals. The bit c_q of a
// node tells whether the next node is in the other row. The paper run-length codes these bits and entropy codes the
// runs. Here each run's length is cut into binary decisions (does it continue?), coded adaptively in contexts that both
// sides know: the previous runs and, beyond the paper, how much of the surface a reference vertex stands for (a large
// patch is hit more often) and how many residuals its neighbours on the reference mesh have.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/mapping_prior.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// The reference vertices that may have residuals, ascending: all if `eligible` is empty, else those of the `references`
// whose entry is not 0 (motion-based coding, section V).
std::vector<std::uint32_t> eligible_references(std::span<const std::uint8_t> eligible, std::size_t references);

// residuals_of[k]: the number of residuals of reference vertex k, 0 if it is not eligible. No counts are sent: both
// sides know N_I and N_t.
std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of, const MappingPrior& prior,
                                         std::span<const std::uint8_t> eligible = {});

// Returns residuals_of, one per reference vertex, with the sum `residuals`; all 0 if no reference vertex is eligible.
Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t residuals,
                                                  const MappingPrior& prior,
                                                  std::span<const std::uint8_t> eligible = {});

}  // namespace htvm::internal
