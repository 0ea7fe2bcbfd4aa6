// An .mp4 of any bytes is read without harm: what comes of it is no more than twice the file. One that was written from
// packets, of any bytes, gives them back, and so do segments in parts.
#include "container/fragment.h"
#include "container/mp4_file.h"
#include "container/mp4_packets.h"
#include "fuzz_input.h"
#include "htvm/audio.hpp"
#include "htvm/texture.hpp"

namespace {

using namespace htvm;
using Bytes = std::vector<std::uint8_t>;
using fuzz::require;

std::optional<Bytes> stream_in(const Bytes& mp4, std::uint64_t& damaged) {
    auto packets = Mp4Packets::open(source_of(mp4), std::uint64_t{1} << 28);
    if (!packets) return std::nullopt;
    Bytes out;
    while (const auto bytes = packets->next()) out.insert(out.end(), bytes->begin(), bytes->end());
    damaged = packets->damaged_bytes();
    return out;
}

std::vector<Packet> any_packets(fuzz::FuzzInput& input) {
    std::vector<Packet> out;
    while (input.left() > 0 && out.size() < 60) {
        Packet packet;
        packet.kind = static_cast<PacketKind>(1 + input.below(13));
        if (packet.kind == PacketKind::front_index) packet.kind = PacketKind::intra;
        packet.flags = input.u8();
        packet.frame = input.below(20);
        packet.reference = input.below(20);
        packet.timestamp_us = static_cast<std::int64_t>(input.flag() ? input.u64() : 33333 * packet.frame);
        const auto bytes = input.take(input.below(120));
        packet.payload.assign(bytes.begin(), bytes.end());
        if (packet.kind == PacketKind::texture && input.flag()) {
            TexturePicture picture;
            constexpr PictureCoder video[] = {PictureCoder::av1, PictureCoder::vp9, PictureCoder::h264};
            picture.coder = video[input.below(3)];
            picture.width = picture.height = 16;
            picture.coded = bytes;
            if (!bytes.empty()) packet = write_texture_picture(picture, {packet.frame, packet.reference, 0, true});
        }
        if (packet.kind == PacketKind::audio && input.flag()) {
            AudioPacket audio;
            audio.opus = {{0xf8}, {0xf8, input.u8()}};
            packet = write_audio(audio, packet.frame, packet.timestamp_us);
        }
        out.push_back(std::move(packet));
    }
    return out;
}

// Maps, each before the parts of its segment: one after another, as a playlist has them.
Bytes parts_of(const std::vector<Packet>& packets, double seconds, double part_seconds) {
    StreamSegmenter segmenter({.seconds = seconds, .part_seconds = part_seconds});
    Bytes out;
    const auto take = [&out](const StreamSegment& part) {
        out.insert(out.end(), part.map.begin(), part.map.end());
        out.insert(out.end(), part.media.begin(), part.media.end());
    };
    for (const auto& packet : packets) {
        const auto part = segmenter.push(packet);
        require(part.has_value(), "small packets fit a segment");
        if (*part) take(**part);
    }
    const auto rest = segmenter.finish();
    require(rest.has_value(), "small packets fit a segment");
    for (const auto& part : *rest) take(part);
    return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    std::uint64_t damaged = 0;
    if (input.flag()) {
        const auto rest = input.rest();
        const Bytes file(rest.begin(), rest.end());
        const auto stream = stream_in(file, damaged);
        require(!stream || stream->size() <= 2 * file.size(), "no more comes of a file than is in it");
        return 0;
    }
    const Mp4Options options{.fragmented = input.flag(), .fragment_seconds = 0.1};
    const auto packets = any_packets(input);
    Bytes expected, mp4;
    for (const auto& packet : packets) {
        const auto bytes = write_packet(packet);
        expected.insert(expected.end(), bytes.begin(), bytes.end());
    }
    const auto open = [&packets]() -> Result<PacketSource> {
        return PacketSource([&packets, next = std::size_t{0}]() mutable {
            return next < packets.size() ? std::optional(packets[next++]) : std::nullopt;
        });
    };
    const auto written = write_mp4(open, std::nullopt, options, [&](std::span<const std::uint8_t> piece) {
        mp4.insert(mp4.end(), piece.begin(), piece.end());
        return Result<void>();
    });
    require(written.has_value() != packets.empty(), "packets can be written");
    if (packets.empty()) return 0;
    const auto back = stream_in(mp4, damaged);
    require(back && damaged == 0, "what is written is read");
    require(*back == expected, "a stream comes back byte for byte");
    const auto parts = stream_in(parts_of(packets, 0.1, 0.04), damaged);
    require(parts && damaged == 0, "segments in parts are read");
    require(*parts == expected, "a stream comes back of its parts");
    return 0;
}
