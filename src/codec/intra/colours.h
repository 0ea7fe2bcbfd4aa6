// Codes the colours of an intra frame, given its connectivity and decoded positions: exactly, or to within half a step.
//
// Each colour is predicted from the decoded neighbours; nearer ones weigh more. Parallelograms are not used, because
// they would add up the noise of three colours. Green is coded first, and red and blue are predicted to be off as green
// was. Prediction uses decoded colours, so errors do not add up; at coarse steps, the decoded colours are first drawn a
// little towards their own prediction, which reduces quantisation noise.
//
// Layer: four bytes (red's share of green's error, blue's share of green's and of red's, in 1/64, signed; the weight of
// the decoded colour in 1/16, 1..16), then the range-coded residuals in the order of Neighbours::order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/neighbours.h"
#include "core/lattice.h"
#include "core/progress.h"

namespace htvm::internal {

struct EncodedColours {
    std::vector<std::uint8_t> bytes;
    std::vector<Colour> decoded;  // the colours that the decoder will have
};

// colours, positions: one per vertex of `neighbours`; positions as decoded, in any unit, on_lattice(). step: 1..255, in
// levels; every component decodes to within step / 2 (rounded down) of the original, so 1 is exact. Without vertices
// there are no bytes. known: as in Known, as `neighbours` was made with. ordered: of how many ranks the rows of
// `neighbours` are there, if they are still being made; or null.
EncodedColours encode_intra_colours(std::span<const Colour> colours, std::span<const LatticePoint> positions,
                                    const Neighbours& neighbours, std::int32_t step,
                                    std::span<const std::uint8_t> known = {}, const Progress* ordered = nullptr);

// Errors: corrupt_stream if the bytes end too early or begin with an invalid weight, if step is not 1..255, or if there
// is not one position per vertex. ordered: as above. located: of how many ranks the positions are there, if they are
// still being decoded; or null.
Result<std::vector<Colour>> decode_intra_colours(std::span<const std::uint8_t> bytes,
                                                 std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                                 std::int32_t step, const Known<Colour>& known = {},
                                                 const Progress* ordered = nullptr, const Progress* located = nullptr);

}  // namespace htvm::internal
