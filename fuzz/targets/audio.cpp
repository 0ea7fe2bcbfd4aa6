// Sound: packets of it in a stream, and Ogg Opus files. What is read from a packet is the same after writing and
// reading again; what is read from a file fits into packets.
#include "htvm/audio.hpp"

#include "core/opus_packet.h"
#include "fuzz_input.h"
#include "io/ogg_opus.h"

namespace {

using namespace htvm;
using fuzz::require;

void check_packet(std::span<const std::uint8_t> bytes) {
    Packet packet;
    packet.kind = PacketKind::audio;
    packet.payload.assign(bytes.begin(), bytes.end());
    const auto audio = read_audio(packet);
    if (!audio) return;
    require(audio->samples() >= audio->skip_begin + std::uint64_t{audio->skip_end},
            "no more is left out than there is");
    const auto again = read_audio(write_audio(*audio, 7, -1));
    require(again && *again == *audio, "a packet of sound comes back");
}

void check_file(std::span<const std::uint8_t> bytes) {
    const auto track = read_ogg_opus(bytes);
    if (!track) return;
    std::uint64_t samples = 0, size = 0;
    for (const auto& packet : track->packets) {
        const auto length = internal::opus_samples(packet);
        require(length.has_value(), "packets are well formed");
        samples += *length;
        size += packet.size();
    }
    require(samples >= track->pre_skip + track->samples && size <= bytes.size(), "no more sound than the file has");
    const auto again = read_ogg_opus(write_ogg_opus(*track));
    require(
        again && again->samples == track->samples && again->pre_skip == track->pre_skip && again->gain == track->gain,
        "a file that is written is read again");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    if (input.flag())
        check_file(input.rest());
    else
        check_packet(input.rest());
    return 0;
}
