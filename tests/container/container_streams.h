// Streams for tests of files that carry them: packets that nobody decodes, with the headers of real ones.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/format/sequence.h"
#include "container/mp4_file.h"
#include "container/mp4_packets.h"
#include "htvm/audio.hpp"
#include "htvm/packet.hpp"
#include "htvm/texture.hpp"

namespace htvm::test {

using Bytes = std::vector<std::uint8_t>;

inline Packet frame_packet(PacketKind kind, std::uint32_t frame, std::uint32_t reference, std::uint8_t flags) {
    Packet out;
    out.kind = kind;
    out.frame = frame;
    out.reference = reference;
    out.flags = static_cast<std::uint8_t>(flags | packet_flag::flags_valid);
    out.timestamp_us = 1000000 + std::int64_t{frame} * 33333;
    out.payload.assign(40 + 7 * frame, static_cast<std::uint8_t>(frame + 1));
    return out;
}

inline Packet header_packet(const char* title = "Anna") {
    internal::SequenceHeader header;
    header.skeleton.joint_names = {"a", "b"};
    header.skeleton.bones = {{0, 1}};
    header.radii = {100};
    header.metadata = {{"title", title}};
    return internal::sequence_packet(header);
}

// A temporal unit of AV1 in the shape of one: a delimiter, for key pictures a sequence header of level 8, and a frame.
inline Packet picture_packet(std::uint32_t frame, std::uint32_t reference, PictureCoder coder = PictureCoder::av1) {
    Bytes coded;
    if (coder == PictureCoder::h264) {
        // An access unit: for key pictures the parameter sets of profile 100, level 31, and a slice.
        if (frame == reference) coded = {0, 0, 0, 5, 0x67, 100, 0, 31, 9, 0, 0, 0, 2, 0x68, 5};
        coded.insert(coded.end(), {0, 0, 0, 2, 0x65, static_cast<std::uint8_t>(frame)});
    } else {
        coded = {0x12, 0x00};
        if (frame == reference) coded.insert(coded.end(), {0x0a, 2, 0x0a, 0});
        coded.insert(coded.end(), {0x32, 2, 0x10, static_cast<std::uint8_t>(frame)});
    }
    TexturePicture picture;
    picture.coder = coder;
    if (!is_video(coder)) picture.matrix = ColourMatrix::none;
    picture.width = 64;
    picture.height = 32;
    picture.coded = coded;
    return write_texture_picture(picture, {frame, reference, 1000000 + std::int64_t{frame} * 33333, true});
}

// Two packets of Opus of 20 ms, `skip` samples of which are not heard.
inline Packet sound_packet(std::uint32_t frame, std::int64_t timestamp_us, std::uint32_t skip = 0) {
    AudioPacket audio;
    audio.skip_begin = skip;
    audio.opus = {{0xf8, static_cast<std::uint8_t>(frame), 1}, {0xf8, static_cast<std::uint8_t>(frame)}};
    return write_audio(audio, frame, timestamp_us);
}

// 12 frames at 30 a second, with the sequence header again before frame 6 and sound between the two: I-frames 0 and 6,
// a TP-frame 3, T-frames that follow each other; decoding can start at 0, 3, 5, which needs 3, 6 and 9. With pictures,
// key pictures of which are at 0 and 6, and sound from 6.5 ms before frame 0.
inline std::vector<Packet> stream_with_all() {
    using enum PacketKind;
    using namespace packet_flag;
    std::vector<Packet> out = {header_packet()};
    std::uint32_t reference = 0;
    std::int64_t sound_us = 1000000 - 6500;
    for (std::uint32_t frame = 0; frame < 12; ++frame) {
        if (frame == 6) {
            out.push_back(header_packet());
            out.back().frame = frame;
            out.push_back(sound_packet(5, sound_us));
            sound_us += 40000;
        }
        if (frame == 0 || frame == 6) {
            out.push_back(frame_packet(intra, frame, frame, referred | access));
            reference = frame;
        } else if (frame == 3) {
            out.push_back(frame_packet(patched, frame, reference, referred | access));
            reference = frame;
        } else {
            const bool start = frame == 5 || frame == 9;
            out.push_back(frame_packet(tracked, frame, start || frame - 1 == reference ? reference : frame - 1,
                                       static_cast<std::uint8_t>(referred | (start ? access : 0))));
        }
        out.push_back(picture_packet(frame, frame % 6 == 0 ? frame : frame - 1));
        if (sound_us < out.back().timestamp_us + 33333) {
            out.push_back(sound_packet(frame, sound_us, frame == 0 ? 312 : 0));
            sound_us += 40000;
        }
    }
    return out;
}

inline Bytes bytes_of(const std::vector<Packet>& packets) {
    Bytes out;
    for (const auto& packet : packets) {
        const auto bytes = write_packet(packet);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return out;
}

inline std::function<Result<PacketSource>()> packets_of(const std::vector<Packet>& packets) {
    return [&packets]() -> Result<PacketSource> {
        return PacketSource([&packets, next = std::size_t{0}]() mutable {
            return next < packets.size() ? std::optional(packets[next++]) : std::nullopt;
        });
    };
}

inline Result<Bytes> mp4_of(const std::vector<Packet>& packets, const Mp4Options& options = {},
                            const std::optional<Packet>& index = std::nullopt) {
    Bytes out;
    const auto done = write_mp4(packets_of(packets), index, options, [&](std::span<const std::uint8_t> piece) {
        out.insert(out.end(), piece.begin(), piece.end());
        return Result<void>();
    });
    if (!done) return tl::unexpected(done.error());
    return out;
}

// The bytes of the stream in an .mp4, how many are said to be damaged, and of these to be cut off, and how many
// of the file to be missing.
struct Unpacked {
    Bytes bytes;
    std::uint64_t damaged = 0, cut_off = 0, missing = 0;
};
inline Result<Unpacked> unpacked(std::span<const std::uint8_t> mp4, bool goes_on = false) {
    auto packets = Mp4Packets::open(htvm::source_of(mp4), std::uint64_t{1} << 28, goes_on);
    if (!packets) return tl::unexpected(packets.error());
    Unpacked out;
    while (const auto bytes = packets->next()) out.bytes.insert(out.bytes.end(), bytes->begin(), bytes->end());
    out.damaged = packets->damaged_bytes();
    out.missing = packets->missing_bytes();
    out.cut_off = packets->cut_off_bytes();
    return out;
}

}  // namespace htvm::test
