// Sound files: Ogg Opus (RFC 7845), taken apart into packets of Opus, and put together from them. Nothing is decoded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

struct OpusTrack {
    std::uint8_t channels = 1;                       // 1 or 2
    std::int16_t gain = 0;                           // by which players raise the sound: 1/256 dB
    std::uint32_t pre_skip = 0;                      // samples at the beginning that are decoded but not heard
    std::uint64_t samples = 0;                       // to be heard after those, at 48 kHz
    std::vector<std::vector<std::uint8_t>> packets;  // each well formed
    bool is_silent = false;                          // every sample of the file that it was coded from is zero
};

// bad_input if it is no such file, is damaged, or has more than two channels: the message says how to make one.
Result<OpusTrack> read_ogg_opus(std::span<const std::uint8_t> file);
Result<OpusTrack> read_ogg_opus(const std::filesystem::path& path);

// The file. Packets behind the last sample that is heard are left out.
std::vector<std::uint8_t> write_ogg_opus(const OpusTrack& track);

}  // namespace htvm
