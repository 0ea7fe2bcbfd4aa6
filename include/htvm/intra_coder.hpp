// The place where another static mesh coder plugs in for I-frames (paper, section III-C).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// How large a mesh packed bytes claim to hold.
struct ClaimedCounts {
    std::uint64_t vertices = 0, triangles = 0;
};

// A static coder that packs a mesh of integers without loss. It may change the order of vertices and triangles, and
// what else its own design changes (see docs/bitstream.md); decode(encode(x)) must be the same on every machine.
// encode is needed by an encoder only, decode by both.
struct ExternalIntraCoder {
    std::uint8_t number = 0;  // its number in the stream
    const char* name = "";
    std::function<Result<std::vector<std::uint8_t>>(const LatticeMesh&)> encode;
    std::function<Result<LatticeMesh>(std::span<const std::uint8_t>)> decode;
    // What decode would take memory for, read without decoding. A decoder refuses more than the frame's header says;
    // without this function it trusts decode to stop by itself.
    std::function<Result<ClaimedCounts>(std::span<const std::uint8_t>)> claims = nullptr;
};

// Draco (in the target htvm_draco, which links libdraco).
ExternalIntraCoder draco_intra_coder();

}  // namespace htvm
