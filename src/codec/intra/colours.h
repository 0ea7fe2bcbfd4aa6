// The colours of an intra frame, given its connectivity and decoded positions: exact, or within half a step.
//
// Each colour is predicted from the decoded neighbours, the nearer the more (not by parallelograms: they would add up
// the noise of three colours); green is coded first, red and blue are predicted to be off as green was. Prediction runs
// on decoded colours, so that errors do not add up; where the step is coarse, on decoded colours drawn a little towards
// their own prediction, which takes quantisation noise out.
//
// Layer: four bytes (red's share of green's error, blue's share of green's and of red's in 1/64, signed; the decoded
// colour's weight in 1/16, 1..16), then the range-coded residuals in the order of Neighbours::order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/neighbours.h"
#include "core/lattice.h"

namespace htvm::internal {

struct EncodedColours {
    std::vector<std::uint8_t> bytes;
    std::vector<Colour> decoded;  // what the decoder will have
};

// colours, positions: one per vertex of `neighbours`; positions as decoded, in any unit, on_lattice(). step: 1..255, in
// levels; every component decodes to within step / 2 (rounded down) of the original: 1 is exact. No vertices give no
// bytes.
EncodedColours encode_intra_colours(std::span<const Colour> colours, std::span<const LatticePoint> positions,
                                    const Neighbours& neighbours, std::int32_t step);

// Errors: corrupt_stream where the bytes end too early or open with an impossible weight, or where step is not 1..255
// or positions are not one per vertex.
Result<std::vector<Colour>> decode_intra_colours(std::span<const std::uint8_t> bytes,
                                                 std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                                 std::int32_t step);

}  // namespace htvm::internal
