// Sound files of all formats that libsndfile reads (WAV, FLAC, MP3, Ogg, AIFF, ...), as samples at 48 kHz, block by
// block: a file of hours takes no more memory than one of seconds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

// The longest sound that is read or written: six hours at 48 kHz, which a WAV of 16 bits can just hold.
inline constexpr std::uint64_t most_sound_samples = std::uint64_t{6} * 3600 * 48000;

class SoundFile {
public:
    // bad_input if it cannot be read, or has more than two channels. Every message begins with the file's name.
    static Result<SoundFile> open(const std::filesystem::path& path);
    SoundFile(SoundFile&&) noexcept;
    SoundFile& operator=(SoundFile&&) = delete;
    ~SoundFile();

    int channels() const;
    // The length of the whole at 48 kHz, as the file tells it; 0: it does not.
    std::uint64_t promised_samples() const;
    // The next samples, one for each channel in turn, within -1..1 unless the file goes beyond; empty at the end. Valid
    // until the next call. limit beyond most_sound_samples, bad_input where the file is damaged.
    Result<std::span<const float>> next();

private:
    struct State;
    explicit SoundFile(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
