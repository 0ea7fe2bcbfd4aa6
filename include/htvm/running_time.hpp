// The time of frames in a whole stream: each of its sequences begins where the one before ends, when its last frame has
// lasted as long as a frame does.
//
// Threads and lifetimes. One object is used by one thread at a time; copies are independent.
#pragma once

#include <cstdint>

#include "htvm/packet.hpp"

namespace htvm {

// Seconds that frames last: from the first timestamp to the last, and then the last frame. This lasts as long as the
// mean frame, or of_one, the duration by the frame rate, if it is the only frame, or if the timestamps are multiples of
// of_one apart and fewer than half of them are missing.
double seconds_of_frames(std::int64_t first_us, std::int64_t last_us, std::uint64_t frames, double of_one);

class RunningTime {
public:
    // Every packet of the stream must be pushed, in order. begins_sequence: FrameNumbers::begins_sequence() of this
    // one.
    void push(const Packet& packet, bool begins_sequence);
    // Begins in the middle of the stream's first sequence, whose first frame has this timestamp. Then only
    // microseconds() is known.
    void begin(std::int64_t first_timestamp_us);
    // When the last frame begins, microseconds from the first one.
    std::uint64_t microseconds() const;
    // When it ends.
    std::uint64_t total_us() const;
    // How long a frame lasts by the frame rate of the sequence header in force, as one that is alone in its sequence
    // does; 0 before any header.
    std::uint64_t one_frame_us() const;

private:
    std::uint64_t before_us_ = 0;              // of the sequences before
    std::int64_t first_us_ = 0, last_us_ = 0;  // timestamps in this one
    std::uint64_t frames_ = 0;                 // of this one
    double of_one_ = 0, of_lone_ = 0;          // seconds, by the header in force; by that of the last frame
    bool in_the_middle_ = false;               // whether this one's first frame did not come
};

}  // namespace htvm
