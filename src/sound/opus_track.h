// Sound as Opus: any sound file to packets of Opus, by libopus.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "htvm/result.hpp"
#include "io/ogg_opus.h"

namespace htvm {

// Bits a second at which speech and music sound like the original to most people.
constexpr std::uint32_t usual_opus_rate(int channels) { return channels == 1 ? 48000 : 96000; }
inline constexpr std::uint32_t least_opus_rate = 6000, most_opus_rate = 510000;

class OpusTrackEncoder {
public:
    // channels: 1 or 2. bits_per_second: least_opus_rate to most_opus_rate.
    static Result<OpusTrackEncoder> create(int channels, std::uint32_t bits_per_second);
    OpusTrackEncoder(OpusTrackEncoder&&) noexcept;
    OpusTrackEncoder& operator=(OpusTrackEncoder&&) = delete;
    ~OpusTrackEncoder();

    // The next samples, at 48 kHz, one for each channel in turn.
    Result<void> push(std::span<const float> samples);
    // The end of the sound; once.
    Result<OpusTrack> finish();

private:
    struct State;
    explicit OpusTrackEncoder(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

struct OpusFileOptions {
    // By default what usual_opus_rate() says; a file that has Opus in it is taken as it is then, and nothing is coded
    // twice.
    std::optional<std::uint32_t> bits_per_second;
    // Told from time to time how many seconds of how many (0: not known) are coded; false ends with bad_input.
    std::function<bool(double seconds, double of)> step;
};

// The sound of a file of any format. Every message begins with the file's name.
Result<OpusTrack> read_opus_track(const std::filesystem::path& path, const OpusFileOptions& options = {});

}  // namespace htvm
