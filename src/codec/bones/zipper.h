// Zippering: joins a coded sub-mesh and the animated rest of the reference mesh into one surface (paper, section V;
// Turk and Levoy 1994). The overlap is trimmed, one border is cut back to the other, and the seam is stitched.
//
// The published method clips the triangles of one mesh against the border of the other. Here the animated side is
// trimmed in whole triangles and the gap is stitched, so there are no new vertices, and the coded part stays as it is.
// The decoder does this too, so it is part of the stream format (bitstream.md, 8.9): integers, or doubles computed with
// + - * / and sqrt alone, in a fixed order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "core/thread.h"

namespace htvm::internal {

// coded: what was received for the moving bones, with a rim of triangles that reaches into the still part. animated:
// the whole predicted mesh M_P (the reference mesh moved by its transforms), with the same attributes. still: one per
// animated vertex, not 0 if its bone was not coded; the animated mesh stands for this part. Returns the vertices of
// `coded` in their order, then the animated vertices still in use, in theirs; the triangles of `coded`, then the kept
// animated ones, then the stitches. Any mesh is allowed: open, non-manifold, in pieces, empty. The work is bounded by a
// small multiple of the counts.
LatticeMesh zipper(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> still,
                   Threads threads);

// The trimming step by itself, for inspection: 1 for each triangle of `animated` that zipper() keeps.
std::vector<std::uint8_t> kept_by_zippering(const LatticeMesh& coded, const LatticeMesh& animated,
                                            std::span<const std::uint8_t> still, Threads threads);

}  // namespace htvm::internal
