// What a decoder accepts: everything that a header claims is held against its options before memory is taken for it.
#pragma once

#include <cstdint>

#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {

struct MeshCounts {
    std::uint64_t vertices = 0, triangles = 0;
};

// The most memory, bytes, that meshes of so many vertices and triangles take, with all attributes, of any
// connectivity: about half as much again as was measured of the worst (tests/memory).
std::uint64_t memory_of_reference(MeshCounts mesh);            // what an I-frame leaves for the frames that refer to it
std::uint64_t memory_of_charts(MeshCounts mesh);               // what charts add to it
std::uint64_t memory_of_tracking(MeshCounts mesh);             // what T-frames add to it
std::uint64_t memory_of_tracked_frame(MeshCounts mesh);        // one that is kept for others of its group
std::uint64_t memory_of_presence(MeshCounts mesh);             // what telling what is there adds to tracking
inline constexpr std::uint64_t memory_of_detail_vertex = 512;  // of the levels below a reference, and while shown

// What decoding a frame of some kind takes besides, the frame itself included; in frame_kinds.cpp for each kind.
struct MemoryBound {
    std::uint64_t coded_vertex, coded_triangle;          // bytes for each that the frame's header says
    std::uint64_t reference_vertex, reference_triangle;  // for each of what it refers to
};
std::uint64_t memory_of_frame(const MemoryBound& bound, MeshCounts coded, MeshCounts reference);

// What decoding the frames of a packet takes that refer to a mesh, counted in vertices shown: about as much time each,
// whatever the kind. shown: with the detail that the mesh is shown with. weight: FrameRules::reference_work.
std::uint64_t work_of_frames(MeshCounts reference, MeshCounts shown, std::uint64_t weight, std::uint64_t frames);

// All that came of a stream, and the work that its frames asked for.
struct ReceivedWork {
    std::uint64_t bytes = 0, work = 0;
};

// Each an error of kind limit that says which option is too low for what.
Result<void> check_limits(const Packet& packet, const DecoderOptions& options);
Result<void> check_limits(const SequenceHeader& header, const DecoderOptions& options);
// A frame's. reference: empty where it refers to nothing. kept: bytes that the decoder holds besides.
Result<void> check_limits(const MemoryBound& bound, MeshCounts coded, MeshCounts reference, std::uint64_t kept,
                          const DecoderOptions& options);
// Counts the work of the frames of a packet, unless that is more than what has been received allows.
Result<void> allow_work(ReceivedWork& received, std::uint64_t work, const DecoderOptions& options);

}  // namespace htvm::internal
