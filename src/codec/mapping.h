// The mapping layer: which reference vertex each residual belongs to (paper, section IV-C3, Fig. 4).
//
// The graph's path visits every reference vertex in order, and after each its residuals. A node's bit c_q says whether
// the next node is in the other row. The paper run-length codes the bits and entropy codes the runs; here each run's
// length is cut into binary decisions (does it go on?), adaptive in context of which bit it repeats, in which row it
// began, how long it is and how long the last two runs were, which costs the same runs less than one common model.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

// residuals_of[k]: how many residuals reference vertex k has. The layer needs no counts: both sides know N_I and N_t.
// Where a residual has no reference vertex (N_I = 0), there is nothing to code.
std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of);

// Gives residuals_of, `references` long, with sum `residuals`.
Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t references,
                                                  std::size_t residuals);

}  // namespace htvm
