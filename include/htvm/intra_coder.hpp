// Lets another static mesh coder code I-frames (paper, section III-C).
//
// Threads and lifetimes. The functions of a coder are called by whichever thread uses the encoder or decoder, and by
// several at once where several share it.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// The numbers of vertices and triangles that a coded mesh claims to have.
struct ClaimedCounts {
    std::uint64_t vertices = 0, triangles = 0;
};

// A static coder that codes a mesh of integers losslessly. It may reorder vertices and triangles, and make the other
// changes that its design implies (see docs/bitstream.md); decode(encode(x)) must be the same on every machine. encode
// is needed by encoders only, decode by both sides.
struct ExternalIntraCoder {
    std::uint8_t number = 0;  // its number in the stream
    const char* name = "";
    std::function<Result<std::vector<std::uint8_t>>(const LatticeMesh&)> encode;
    std::function<Result<LatticeMesh>(std::span<const std::uint8_t>)> decode;
    // Reads, without decoding, the counts for which decode would allocate memory. A decoder refuses more than the
    // frame's header says. Without this function it relies on decode to limit itself.
    std::function<Result<ClaimedCounts>(std::span<const std::uint8_t>)> claims = nullptr;
};

// Draco (in the target htvm_draco, which links libdraco).
ExternalIntraCoder draco_intra_coder();

}  // namespace htvm
