// A stream that was recorded, made live: its sequences get sessions of their own, so that nobody takes a round of it
// for another, and its time goes on from round to round.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "htvm/frame_numbers.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/running_time.hpp"

namespace htvm::app {

class LiveRounds {
public:
    // session: draws a number for each sequence. speed: at which time goes by; the timestamps follow.
    explicit LiveRounds(std::function<std::uint64_t()> session, double speed = 1)
        : session_(std::move(session)), speed_(speed) {}

    // The packets from here on are those of the beginning again.
    void begin_round();
    // The packets to publish now, which may be none: a header waits for the first frame behind it, and indices are left
    // out. unsupported: a stream of version 1, whose headers do not tell hubs what depends on what.
    Result<std::vector<Packet>> take(Packet packet);

    // What comes from here on is so much later than it would be.
    void put_off(std::uint64_t microseconds) { put_off_us_ += microseconds; }

    std::uint64_t frames() const { return frames_; }  // of all rounds
    // When the last frame of all ends, microseconds from the first one, at the stream's own speed.
    std::uint64_t end_us() const { return time_.total_us() + put_off_us_; }

private:
    Result<Packet> header_of_session(const Packet& header) const;
    Packet in_time(Packet packet) const;

    std::function<std::uint64_t()> session_;
    double speed_;
    FrameNumbers numbers_;  // of this round
    RunningTime time_;      // of all
    std::uint64_t put_off_us_ = 0;
    std::uint64_t drawn_ = 0;
    std::optional<Packet> header_;  // waits for the frame behind it
    std::vector<Packet> waiting_;   // likewise
    double later_us_ = 0;           // added to timestamps
    bool begun_ = false;            // this round has had a frame
    std::uint64_t frames_ = 0;
};

}  // namespace htvm::app
