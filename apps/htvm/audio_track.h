// The sound of a capture, laid between the frames of its stream.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "htvm/audio.hpp"
#include "htvm/running_time.hpp"
#include "io/ogg_opus.h"

namespace CLI {
class App;
}

namespace htvm::app {

struct AudioOptions {
    std::string file;     // any sound file; empty: no sound
    double delay = 0;     // seconds from the first frame to the beginning of the sound; below 0, so much is left out
    double kilobits = 0;  // a second, for Opus; 0: the usual rate, and Opus files are taken as they are
};

// Adds --audio, --audio-delay and --audio-bitrate to a command.
void add_audio_options(CLI::App& command, AudioOptions& options);

// Gives out the sound behind the frame in whose time it begins, and cuts it where the frames end.
class AudioTrack {
public:
    // Nothing if no file is given. Sound that is not Opus yet is coded now, with progress on the terminal.
    static Result<std::optional<AudioTrack>> open(const AudioOptions& options);

    // The sound that lies before a packet of the stream. Takes every packet, in order.
    std::vector<Packet> before(const Packet& packet);
    // The sound behind the last frame, up to the end of its time; once.
    std::vector<Packet> rest();

private:
    AudioTrack(OpusTrack track, double delay);
    std::vector<Packet> up_to(std::int64_t time_us, bool last);
    std::int64_t time_us(std::uint64_t sample) const;

    OpusTrack track_;
    std::vector<std::uint64_t> begins_;  // of each packet: samples before it; and of all
    std::int64_t delay_us_ = 0;
    RunningTime time_;                         // for how long a frame lasts
    std::optional<std::int64_t> first_us_;     // of the first frame
    std::int64_t last_us_ = 0;                 // of the last one
    std::uint32_t frame_ = 0;                  // its number
    std::size_t next_ = 0;                     // of the packets
    bool is_heard_ = false, is_over_ = false;  // any was given out; all was
};

}  // namespace htvm::app
