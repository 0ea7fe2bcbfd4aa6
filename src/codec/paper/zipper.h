// Zippering: joins a coded sub-mesh and the animated rest of the reference mesh into one surface (paper, section V;
// Turk and Levoy 1994): the overlap is trimmed, one border cut back to the other, and the seam stitched.
//
// The published method clips the triangles of one mesh against the border of the other. Here the animated side is
// trimmed in whole triangles and the gap is stitched: no new vertices, and the coded part stays as it is. The decoder
// does this too, so it is part of the stream's meaning (bitstream.md, 8.9): integers, or doubles built from + - * / and
// sqrt alone, in a stated order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "core/thread.h"

namespace htvm::internal {

// coded: what arrived for the moving bones, with a rim of triangles that reaches into the still part.
// animated: the whole predicted mesh M_P (reference mesh moved by its transforms), with the same attributes.
// still: one per animated vertex, not 0 where its bone was not coded: the part that the animated mesh stands for.
// Gives the vertices of `coded` in their order, then the animated vertices still in use in theirs; the triangles of
// `coded`, then the animated ones that are kept, then the stitches. Any mesh is legal: open, non-manifold, in pieces,
// empty. Work is bounded by a small multiple of the counts.
LatticeMesh zipper(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> still,
                   Threads threads);

// Trimming alone, to be looked at: of each triangle of `animated`, 1 where zipper() keeps it.
std::vector<std::uint8_t> kept_by_zippering(const LatticeMesh& coded, const LatticeMesh& animated,
                                            std::span<const std::uint8_t> still, Threads threads);

}  // namespace htvm::internal
