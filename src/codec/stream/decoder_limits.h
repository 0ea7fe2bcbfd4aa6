// What a decoder accepts: everything that a header claims is held against its options before memory is taken for it.
#pragma once

#include <cstdint>

#include "codec/stream/frame_payload.h"
#include "codec/stream/sequence.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {

struct MeshCounts {
    std::uint64_t vertices = 0, triangles = 0;
};

// The most memory, bytes, that meshes of so many vertices and triangles take, with all attributes, of any
// connectivity: about half as much again as was measured of the worst (tests/memory).
std::uint64_t memory_of_reference(MeshCounts mesh);  // what an I-frame leaves for the frames that refer to it
std::uint64_t memory_of_tracking(MeshCounts mesh);   // what the first T-frame adds to it
// What decoding a frame takes besides, the frame itself included. `coded`: as its header says; `reference`: of what it
// refers to, empty for an I-frame.
std::uint64_t memory_of_frame(FrameType type, MeshCounts coded, MeshCounts reference);

// Each an error of kind limit that says which option is too low for what.
Result<void> check_limits(const Packet& packet, const DecoderOptions& options);
Result<void> check_limits(const SequenceHeader& header, const DecoderOptions& options);
// kept: bytes that the decoder holds already. reference: as above.
Result<void> check_limits(FrameType type, const FrameHeader& header, MeshCounts reference, std::uint64_t kept,
                          const DecoderOptions& options);

}  // namespace htvm::internal
