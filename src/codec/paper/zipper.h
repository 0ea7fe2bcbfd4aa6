// Zippering: joins a coded sub-mesh and the animated rest of the reference mesh into one surface (paper, section V;
// Turk and Levoy 1994): the overlap is trimmed, one border cut back to the other, and the seam stitched. Decoder side,
// and part of the stream's meaning: integers, or doubles built from + - * / and sqrt alone.
#pragma once

#include <cstdint>
#include <span>

#include "codec/reference/lattice_mesh.h"
#include "core/thread.h"

namespace htvm::internal {

// coded: what arrived for the moving bones, with a rim of triangles that reaches into the still part.
// animated: the whole predicted mesh M_P (reference mesh moved by its transforms), with the same attributes.
// still: one an animated vertex, not 0 where its bone was not coded: the part that the animated mesh stands for.
// Gives the vertices of `coded` in their order, then the animated vertices still in use in theirs; the triangles of
// `coded`, then the animated ones that are kept, then the stitches. Any mesh is legal: open, non-manifold, in pieces,
// empty. Work is bounded by a small multiple of the counts.
LatticeMesh zipper(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> still,
                   Threads threads);

}  // namespace htvm::internal
