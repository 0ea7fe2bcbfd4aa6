// Codes the positions of an intra frame losslessly, given its connectivity.
//
// A vertex is predicted from the known vertices around it: a combination of the mean of its neighbours, its
// parallelograms and the mean of its neighbours' neighbours, with weights that the encoder fits to the frame and sends.
// The residual is coded component by component. The component most perpendicular to the surface comes last: given the
// other two, it is predicted to lie in the plane of the known triangles. The contexts are the sizes of the residuals
// around, separately along and across the surface, and where within a step the prediction fell.
//
// Layer: six signed bytes (weights in 1/64), then the range-coded residuals in the order of Neighbours::order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/neighbours.h"
#include "core/lattice.h"
#include "core/progress.h"

namespace htvm::internal {

// q: one point per vertex, q.size() == neighbours.vertex_count(), every point on_lattice(). Without vertices there are
// no bytes. known: as in Known, as `neighbours` was made with. ordered: of how many ranks the rows of `neighbours` are
// there, if they are still being made; or null.
std::vector<std::uint8_t> encode_intra_positions(std::span<const LatticePoint> q, const Neighbours& neighbours,
                                                 std::span<const std::uint8_t> known = {},
                                                 const Progress* ordered = nullptr);

// The points that were encoded. Errors: corrupt_stream if the bytes end too early or lead off the lattice.
Result<std::vector<LatticePoint>> decode_intra_positions(std::span<const std::uint8_t> bytes,
                                                         const Neighbours& neighbours,
                                                         const Known<LatticePoint>& known = {});
// The same into points, one per vertex. ordered: as above. progress: how many ranks of the coding order are decoded,
// for whoever follows; or null.
Result<void> decode_intra_positions(std::span<const std::uint8_t> bytes, const Neighbours& neighbours,
                                    const Known<LatticePoint>& known, std::span<LatticePoint> points,
                                    const Progress* ordered, Progress* progress);

}  // namespace htvm::internal
