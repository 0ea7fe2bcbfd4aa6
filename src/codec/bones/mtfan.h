// Connectivity of an EP-frame: M-TFAN (the paper's section IV-D). The decoder already has the vertices, in an order of
// their own. So the triangle fans of tfan.h also tell which vertex each newly visited one is, by its generalised
// distance order (eq. 8): its place among those of the m vertices nearest to the fan's centre that are not yet visited.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/format/sequence.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct EncodedMtfan {
    std::vector<std::uint8_t> fans;             // the same layer as in TFAN
    std::vector<std::uint8_t> distance_orders;  // the layer that assigns vertices to visits
    // What the decoder returns: vertices keep the numbers of the positions; triangles are in visiting order, each
    // rotated to begin with its focus.
    std::vector<Triangle> triangles;
    // How often each distance order 0 .. m - 1 was coded; the last entry counts the escapes (indices coded directly).
    std::vector<std::uint32_t> distance_order_counts;
};

// decoded_positions: as the decoder has them, on the lattice. m: 1 .. mtfan_max_nearest; the paper uses 8, 16, 32.
// Every triangle index must be < decoded_positions.size(). The bytes do not depend on the number of threads.
EncodedMtfan encode_mtfan(std::span<const LatticePoint> decoded_positions, std::span<const Triangle> triangles, int m,
                          Threads threads);

// corrupt_stream if m is out of range, or if the bytes name an impossible vertex or end early. Time and memory are
// bounded by the counts, as in decode_tfan, plus a search for the nearest vertices of each vertex.
Result<std::vector<Triangle>> decode_mtfan(std::span<const std::uint8_t> fans,
                                           std::span<const std::uint8_t> distance_orders,
                                           std::span<const LatticePoint> positions, std::uint32_t triangle_count, int m,
                                           Threads threads);

}  // namespace htvm::internal
