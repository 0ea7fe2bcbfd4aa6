// The payload of packets of sound. docs/bitstream.md, section 13.
#include "core/bytes.h"
#include "core/opus_packet.h"
#include "htvm/audio.hpp"

namespace htvm {

using namespace internal;
namespace {

constexpr std::uint8_t coder_opus = 1;

tl::unexpected<Error> corrupt(const char* what) {
    return fail(ErrorKind::corrupt_stream, std::string("audio: ") + what);
}

}  // namespace

std::uint64_t AudioPacket::samples() const {
    std::uint64_t out = 0;
    for (const auto& packet : opus) out += opus_samples(packet).value_or(0);
    return out;
}

Packet write_audio(const AudioPacket& audio, std::uint32_t frame, std::int64_t timestamp_us) {
    ByteWriter out;
    out.u8(coder_opus);
    out.u8(audio.channels);
    out.u16(static_cast<std::uint16_t>(audio.gain));
    out.varint(audio.skip_begin);
    out.varint(audio.skip_end);
    out.u8(static_cast<std::uint8_t>(audio.opus.size()));
    for (const auto& packet : audio.opus) out.varint(packet.size());
    for (const auto& packet : audio.opus) out.bytes(packet);
    Packet packet;
    packet.kind = PacketKind::audio;
    packet.flags = packet_flag::flags_valid | packet_flag::droppable;
    packet.frame = packet.reference = frame;
    packet.timestamp_us = timestamp_us;
    packet.payload = out.take();
    return packet;
}

Result<AudioPacket> read_audio(const Packet& packet) {
    if (packet.kind != PacketKind::audio) return corrupt("the packet is another");
    ByteReader in(packet.payload);
    const auto coder = in.u8();
    if (in.ok() && coder != coder_opus)
        return fail(ErrorKind::unsupported, "audio: coder " + std::to_string(coder) + " is not known; Opus is 1");
    AudioPacket out;
    out.channels = in.u8();
    out.gain = static_cast<std::int16_t>(in.u16());
    const auto skip_begin = in.varint(), skip_end = in.varint();
    std::vector<std::uint64_t> sizes(in.u8());
    for (auto& size : sizes) size = in.varint();
    if (!in.ok()) return corrupt("it ends too early");
    if (out.channels < 1 || out.channels > 2) return corrupt("it has neither one channel nor two");
    std::uint64_t samples = 0;
    for (const auto size : sizes) {
        const auto bytes = in.bytes(size);
        const auto length = opus_samples(bytes);
        if (!in.ok() || !length) return corrupt("a packet of Opus is cut short or malformed");
        samples += *length;
        out.opus.emplace_back(bytes.begin(), bytes.end());
    }
    if (out.opus.empty()) return corrupt("there is no sound in it");
    if (skip_begin > samples || skip_end > samples - skip_begin) return corrupt("more is left out than there is");
    out.skip_begin = static_cast<std::uint32_t>(skip_begin);
    out.skip_end = static_cast<std::uint32_t>(skip_end);
    return out;
}

}  // namespace htvm
