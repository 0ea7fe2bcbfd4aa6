// Streams one after the other as one stream, without encoding anything again. Those with the same header become one
// sequence, whose frames are numbered on: parts of a stream become what they were.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "htvm/frame_numbers.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/running_time.hpp"
#include "stream_file.h"

namespace htvm::app {

class StreamJoin {
public:
    explicit StreamJoin(StreamOutput& output) : output_(output) {}
    // The packets taken from here on are those of another stream.
    void begin_stream() { stream_ = {}; }
    // Timestamps stay, unless they would not ascend; then those of the stream are moved behind the last. Indices are
    // left out, as StreamOutput makes one, but their bounds are kept.
    Result<void> take(Packet packet);

    std::uint64_t frames() const { return frames_; }      // of all streams
    std::size_t sequences() const { return sequences_; }  // of the output
    bool has_frames() const { return stream_.begun; }     // of the last stream
    // If the last stream goes on with the sequence before it: the seconds without frames between them. Less than 0: its
    // timestamps had to be moved.
    std::optional<double> pause_seconds() const { return stream_.pause_seconds; }

private:
    struct Stream {
        FrameNumbers numbers;
        RunningTime time;
        std::optional<Packet> in_force;  // its sequence header
        std::optional<Packet> header;    // waits for the frame behind it
        std::vector<Packet> waiting;     // likewise, codebooks and others
        std::uint32_t first = 0;         // own number of its sequence's first frame,
        std::uint64_t number = 0;        // and that in the output
        std::int64_t later_us = 0;       // added to timestamps
        bool begun = false;
        std::optional<double> pause_seconds;
    };
    void begin_sequence(const Packet& frame);
    Packet moved(Packet packet) const;
    Result<void> check_number(const Packet& frame) const;
    Result<void> write_frame(Packet packet);

    StreamOutput& output_;
    Stream stream_;
    std::optional<std::vector<std::uint8_t>> header_;  // payload of the one in force in the output
    std::uint64_t frames_ = 0;
    std::size_t sequences_ = 0;
    std::uint64_t next_number_ = 0;  // in the sequence in force
    std::int64_t last_us_ = 0;
};

}  // namespace htvm::app
