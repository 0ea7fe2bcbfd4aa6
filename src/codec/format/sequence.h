// What is said once of a sequence: its header, which a decoder must know before any frame, and the index at a file's
// end, which says where the I-frames are.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/lattice.h"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "htvm/skeleton.hpp"
#include "htvm/texture_layout.hpp"

namespace htvm::internal {

// Raised with every change of the syntax, or of a constant that both sides use. Versions from oldest_version to
// newest_version are read, stream_version is written, grouped_version where T-frames come in groups, textured_version
// where there is a texture, presence_version where surface comes and goes, and projected_version where the texture is a
// camera's film.
inline constexpr std::uint16_t stream_version = 4, newest_version = 8;
inline constexpr std::uint16_t oldest_version = 1;

// From this version on a sequence header has a session. The headers of all versions since have the same syntax.
inline constexpr std::uint16_t session_version = 2;
// From this version on a T-frame's payload is one run (tracked/tracked_payload.h).
inline constexpr std::uint16_t tracked_run_version = 3;
// From this version on the meshes of a stream with nodes are shown smoothed within their quantiser cells
// (reference/reference.h); before, only what T-frames move is smoothed.
inline constexpr std::uint16_t shown_smoothed_version = 4;
// From this version on a T-frame's payload begins with its place in a group (tracked/frame_group.h).
inline constexpr std::uint16_t grouped_version = 5;
// From this version on a sequence header says how meshes wear a texture, and frames may have charts
// (charts/chart_layer.h).
inline constexpr std::uint16_t textured_version = 6;
// From this version on a frame says which of its reference's vertices are there (tracked/presence.h).
inline constexpr std::uint16_t presence_version = 7;
// From this version on a texture may be a camera's film, and a frame says how that camera saw its surface
// (reference/film_projection.h).
inline constexpr std::uint16_t projected_version = 8;

// The most that m, the number of nearest vertices among which M-TFAN names a new one, may be (bones/mtfan.h). The
// paper's are 8, 16 and 32.
inline constexpr int mtfan_max_nearest = 64;

// 0, 1, 2 for x, y, z. The direction must be known.
inline std::size_t axis_of(UpAxis up) { return (static_cast<std::size_t>(up) - 1) / 2; }

struct SequenceHeader {
    // As read, and as written, since what follows in the stream is of this version; but version 1 as 2, whose frames
    // have the same syntax.
    std::uint16_t version = stream_version;
    Lattice lattice;
    std::uint32_t fps_numerator = 30, fps_denominator = 1;
    std::uint32_t unit_micrometres = 1000;  // the unit that the capture came in, so that a decoder can give it back
    bool has_skeleton = true;               // false: the bones stand in for a skeleton that the capture does not have
    Skeleton skeleton;                      // at least one bone
    std::vector<std::int32_t> radii;        // r^i of each bone, lattice units
    std::int32_t node_spacing = 0;          // of T-frames' deformation nodes, lattice units; 0: no T-frames
    std::uint8_t nearest_vertices = 16;     // m of the distance order
    std::int32_t weight_width = 0;          // of smooth_weights(), lattice units; 0: rigid skinning, as in the paper
    std::uint64_t session = 0;              // a new random number each time a live publisher starts; 0: none
    UpAxis up = UpAxis::unknown;
    std::optional<std::int32_t> floor;  // coordinate of the floor on the axis that is up, lattice units
    std::vector<MetadataEntry> metadata;
    StreamTexture texture;
    GlobalShift global_shift{};
};

// Limits of the metadata: bytes of a key (at least 1), of a value, and in total; number of entries.
inline constexpr std::size_t most_key_bytes = 255, most_value_bytes = 4095, most_metadata_bytes = 16384;
inline constexpr std::size_t most_metadata = 255;
// bad_input if a limit is exceeded, a key is empty, or a text is not UTF-8 or contains a zero.
Result<void> check_metadata(std::span<const MetadataEntry> metadata);

std::vector<std::uint8_t> write_sequence_header(const SequenceHeader& header);
Result<SequenceHeader> read_sequence_header(std::span<const std::uint8_t> payload);
Packet sequence_packet(const SequenceHeader& header);

// Whether a sequence header begins a new sequence; otherwise it repeats the one in force. same: its payload is that of
// the one in force; frame: the number in its packet; highest: the highest frame number since the sequence began. With a
// session, a publisher may repeat the header together with old frames, for viewers that join. Without one, frame
// numbers that start again mean that another file was joined to the previous one.
inline bool begins_sequence(bool same, bool has_session, std::uint32_t frame, std::optional<std::uint32_t> highest) {
    return !same || (!has_session && highest && frame <= *highest);
}

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
