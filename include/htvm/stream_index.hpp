// The index at the beginning of a finished file: its duration, its bounds, and where decoding can start.
// A live stream has none. docs/bitstream.md, section 9.
//
// Threads and lifetimes. A StreamIndexer is used by one thread at a time; functions keep no state. What they return is
// a copy.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "htvm/frame_numbers.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/running_time.hpp"
#include "htvm/scene.hpp"

namespace htvm {

// A frame at which decoding can start. Frames are numbered through the whole file (frame_numbers.hpp).
struct AccessPoint {
    std::uint64_t frame = 0;
    std::int64_t timestamp_us = 0;
    std::uint64_t offset = 0;  // of its packet: bytes behind the index packet
    std::uint32_t back = 0;  // how many entries before this one is the frame that it refers to; 0: it refers to nothing
    std::uint8_t flags = 0;  // of its packet
    bool operator==(const AccessPoint&) const = default;
};

// A sequence of the file.
struct SequencePoint {
    std::uint64_t offset = 0;       // of its header packet: bytes behind the index packet
    std::uint64_t first_frame = 0;  // as above
    bool operator==(const SequencePoint&) const = default;
};

struct StreamIndex {
    std::uint64_t frames = 0;
    std::int64_t first_timestamp_us = 0;
    std::uint64_t duration_us = 0;      // of all sequences, each until its last frame ends: seconds_of_frames()
    std::uint64_t bytes = 0;            // of the stream behind the index packet
    std::optional<SpaceBounds> bounds;  // contain all decoded positions
    std::vector<SequencePoint> sequences;
    std::vector<AccessPoint> points;  // ascending
    bool operator==(const StreamIndex&) const = default;
};

Packet write_index(const StreamIndex& index);
// corrupt_stream if the packet is not an index, or its payload contradicts itself or ends early.
Result<StreamIndex> read_index(const Packet& packet);

// The entry at which to start for a frame: the last one at or before it from which all later frames can be decoded, or
// null.
const AccessPoint* point_before(const StreamIndex& index, std::uint64_t frame);
// The sequence that an entry belongs to, or null.
const SequencePoint* sequence_of(const StreamIndex& index, const AccessPoint& point);

// Builds the index of a stream while its packets are written.
class StreamIndexer {
public:
    // offset: where the packet begins, bytes from the beginning of the stream without its index.
    void add(const Packet& packet, std::uint64_t offset);
    // The bounds of a frame.
    void add(const SpaceBounds& bounds);
    const std::optional<SpaceBounds>& bounds() const { return index_.bounds; }  // of all of them so far
    // bytes: of the stream without its index.
    StreamIndex finish(std::uint64_t bytes);

private:
    // The frame in force as the reference, and its place among the entries.
    struct Referred {
        std::uint32_t frame;
        std::size_t entry;
    };
    FrameNumbers numbers_;
    RunningTime time_;
    StreamIndex index_;
    std::optional<Referred> reference_;
    std::uint64_t header_offset_ = 0;
};

}  // namespace htvm
