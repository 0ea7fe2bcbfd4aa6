// Packets of live streams, as small as tests need them: only their headers mean something.
#pragma once

#include <cstdint>

#include "codec/format/sequence.h"
#include "htvm/packet.hpp"

namespace htvm::live {

inline Packet live_packet(PacketKind kind, std::uint32_t frame, std::uint32_t reference, std::uint8_t flags,
                          std::size_t bytes) {
    Packet out;
    out.kind = kind;
    out.frame = frame;
    out.reference = reference;
    out.flags = static_cast<std::uint8_t>(packet_flag::flags_valid | flags);
    out.timestamp_us = std::int64_t{33333} * frame;
    out.payload.assign(bytes, static_cast<std::uint8_t>(frame));
    return out;
}
inline Packet live_header(std::uint32_t session, std::size_t bytes = 40) {
    return live_packet(PacketKind::sequence, 0, session, packet_flag::session, bytes);
}
// A header that can be read, and tells something of the stream.
inline Packet readable_header(std::uint64_t session, std::uint32_t fps) {
    internal::SequenceHeader out;
    out.session = session;
    out.fps_numerator = fps;
    out.skeleton.joint_names = {"a", "b"};
    out.skeleton.bones = {{0, 1}};
    out.radii = {1};
    return internal::sequence_packet(out);
}
inline Packet live_intra(std::uint32_t frame, std::size_t bytes = 300) {
    return live_packet(PacketKind::intra, frame, frame, packet_flag::referred | packet_flag::access, bytes);
}
inline Packet live_tracked(std::uint32_t frame, std::size_t bytes = 100) {
    return live_packet(PacketKind::tracked, frame, frame - 1, packet_flag::referred, bytes);
}

}  // namespace htvm::live
