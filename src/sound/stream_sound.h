// The sound of a stream as a file: WAV, decoded by libopus, or Ogg Opus, whose packets are the stream's own where they
// follow each other, and coded again where they do not, as where streams were joined or some of it is missing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "htvm/audio.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct SoundPiece {
    AudioPacket audio;
    std::int64_t begin = 0;  // where its first sample lies, heard or not: samples from the file's begin, -2^48..2^48
};

struct SoundFileSummary {
    std::uint64_t samples = 0;  // of the file, at 48 kHz
    int channels = 1;           // as many as the piece with the most
    bool coded_again = false;   // Opus that is not the stream's own
    std::uint64_t damaged = 0;  // packets of Opus that cannot be decoded: silence
};

// True for .wav, .opus, .ogg and .oga, in either case.
bool is_written_sound_name(const std::filesystem::path& path);
inline constexpr std::string_view written_sound_extensions = ".opus, .ogg, .wav";

// Writes what is heard from 0 up to `end`, silence where nothing is; pieces that overlap are both heard. It ends with
// the last piece if that is earlier. The pieces in their order in the stream; of one that begins more than a second
// before another that it follows, a part may be missing. limit if it is longer than most_sound_samples, bad_input if
// nothing is heard at all. Every message begins with the file's name.
Result<SoundFileSummary> write_stream_sound(const std::filesystem::path& path, std::vector<SoundPiece> pieces,
                                            std::int64_t end);

}  // namespace htvm
