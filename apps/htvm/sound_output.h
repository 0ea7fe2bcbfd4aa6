// The sound of a stream, or of some of its frames, into a file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "htvm/frame_numbers.hpp"
#include "htvm/packet.hpp"
#include "htvm/running_time.hpp"
#include "sound/stream_sound.h"

namespace htvm::app {

struct SoundRange {
    std::uint64_t first = 0;   // frame, counted through the whole stream; the file begins with it
    std::uint64_t frames = 0;  // 0: all that follow
};

class SoundOutput {
public:
    SoundOutput(std::string path, SoundRange range) : path_(std::move(path)), range_(range) {}

    // Takes every packet of the stream, in order. limit if the sound is larger than fits; corrupt_stream if a packet of
    // sound cannot be read.
    Result<void> take(const Packet& packet);
    // Whether nothing that follows is asked for.
    bool is_enough() const { return end_us_.has_value(); }
    // Writes the file and says what was written. bad_input if there is no sound; input: the stream's name.
    Result<void> finish(const std::string& input);

private:
    std::string path_;
    SoundRange range_;
    FrameNumbers numbers_;
    RunningTime time_;
    std::int64_t frame_timestamp_us_ = 0;
    bool any_frame_ = false;
    std::optional<double> begin_us_, end_us_;  // of the range, in running time
    struct Piece {
        AudioPacket audio;
        double begin_us = 0;  // running time
    };
    std::vector<Piece> pieces_;
    std::uint64_t bytes_ = 0;
};

}  // namespace htvm::app
