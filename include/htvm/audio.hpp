// Sound in a stream: packets of Opus (RFC 6716) beside the frames, for programs that make, cut or check streams. The
// decoder passes over them; players hand them to a decoder of Opus. docs/bitstream.md, section 13, is normative.
//
// Threads and lifetimes. Functions keep no state: any thread may call them at any time. What they return is a copy.
#pragma once

#include <cstdint>
#include <vector>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm {

// What is heard from the time of one frame to the next. Samples are counted at 48 kHz, as all of Opus is decoded. A
// packet's timestamp is the time of its first sample, whether it is heard or not.
struct AudioPacket {
    std::uint8_t channels = 1;     // 1 or 2
    std::int16_t gain = 0;         // by which players raise the sound: 1/256 dB
    std::uint32_t skip_begin = 0;  // samples that are decoded but not heard, at its beginning: where a coder starts
    std::uint32_t skip_end = 0;    // the same at its end
    std::vector<std::vector<std::uint8_t>> opus;  // 1 to 255 packets

    // All samples, heard or not; the Opus packets must be valid.
    std::uint64_t samples() const;
    bool operator==(const AudioPacket&) const = default;
};

inline constexpr std::uint32_t audio_samples_per_second = 48000;

// frame: number of the frame that the packet follows.
Packet write_audio(const AudioPacket& audio, std::uint32_t frame, std::int64_t timestamp_us);
// corrupt_stream if the payload ends early or contradicts itself; unsupported if it is of another coder than Opus.
Result<AudioPacket> read_audio(const Packet& packet);

}  // namespace htvm
