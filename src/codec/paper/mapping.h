// The mapping layer: which reference vertex each residual belongs to (paper, section IV-C3, Fig. 4).
//
// The graph's path visits every reference vertex in order, and after each its residuals. A node's bit c_q says whether
// the next node is in the other row. The paper run-length codes the bits and entropy codes the runs; here each run's
// length is cut into binary decisions (does it go on?), coded adaptively in contexts that both sides know: the runs
// before, and, past the paper, how much of the surface a reference vertex stands for (a large patch is hit more often)
// and how many residuals its neighbours on the reference mesh have got.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// What the reference mesh says of its vertices, once per I-frame.
struct MappingPrior {
    std::vector<std::uint8_t> area_class;        // 0..9: a third of the area of the triangles around, against the mean
    std::vector<std::uint32_t> first_neighbour;  // vertices + 1 offsets
    std::vector<std::uint32_t> neighbours;       // of lower index, from triangles; at most 8 each, may repeat
};
MappingPrior make_mapping_prior(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

// Reference vertices that may have residuals: where eligible is empty, all; else those of the `references` whose entry
// is not 0 (motion-based coding, section V). Ascending.
std::vector<std::uint32_t> eligible_references(std::span<const std::uint8_t> eligible, std::size_t references);

// residuals_of[k]: how many residuals reference vertex k has, 0 where it is not eligible. The layer needs no counts:
// both sides know N_I and N_t.
std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of, const MappingPrior& prior,
                                         std::span<const std::uint8_t> eligible = {});

// Gives residuals_of, one per reference vertex, with sum `residuals`; where no reference vertex is eligible, all 0.
Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t residuals,
                                                  const MappingPrior& prior,
                                                  std::span<const std::uint8_t> eligible = {});

}  // namespace htvm::internal
