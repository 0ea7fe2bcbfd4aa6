// What is said once of a sequence: its header, which a decoder must know before any frame, and the index at a file's
// end, which says where the I-frames are.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/lattice.h"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::internal {

inline constexpr std::uint16_t stream_version = 1;

// The most that m, the number of nearest vertices among which M-TFAN names a new one, may be (paper/mtfan.h). The
// paper's are 8, 16 and 32.
inline constexpr int mtfan_max_nearest = 64;

struct SequenceHeader {
    Lattice lattice;
    std::uint32_t fps_numerator = 30, fps_denominator = 1;
    std::uint32_t unit_micrometres = 1000;  // the unit that the capture came in, so that a decoder can give it back
    bool skeleton_tracked = true;           // false: the bones stand in for a skeleton that the capture does not have
    Skeleton skeleton;                      // at least one bone
    std::vector<std::int32_t> radii;        // r^i of each bone, lattice units
    std::int32_t node_spacing = 0;          // of T-frames' deformation nodes, lattice units; 0: no T-frames
    std::uint8_t nearest_vertices = 16;     // m of the distance order
    std::int32_t weight_width = 0;          // of smooth_weights(), lattice units; 0: rigid skinning, as in the paper
};

std::vector<std::uint8_t> write_sequence_header(const SequenceHeader& header);
Result<SequenceHeader> read_sequence_header(std::span<const std::uint8_t> payload);

// Where an I-frame's packet begins: bytes from the start of the stream. Seek there, once the sequence header is known.
struct IndexEntry {
    std::uint32_t frame = 0;
    std::int64_t timestamp_us = 0;
    std::uint64_t offset = 0;
    bool operator==(const IndexEntry&) const = default;
};
std::vector<std::uint8_t> write_sequence_index(std::span<const IndexEntry> entries);
Result<std::vector<IndexEntry>> read_sequence_index(std::span<const std::uint8_t> payload);

}  // namespace htvm::internal
