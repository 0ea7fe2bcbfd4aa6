// The stream: self-delimiting packets. A sequence header comes first, then at least one packet per frame.
// docs/bitstream.md is normative.
//
// Threads and lifetimes. A PacketReader is used by one thread at a time; functions keep no state. Packets own their
// bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

enum class PacketKind : std::uint8_t {
    sequence = 1,     // sequence header: needed before any frame; may be repeated
    intra = 2,        // I-frame
    enhanced = 3,     // EP-frame: refers to an I-frame
    codebook = 4,     // a codebook that later EP-frames refer to
    index = 5,        // where the I-frames are, at the end of a stream; optional
    predicted = 6,    // P-frame: the I-frame's mesh moved
    tracked = 7,      // T-frame: the reference's mesh laid on the captured surface
    front_index = 8,  // contents of a finished file and where they are, at its beginning; optional
    audio = 10,       // sound of the time from a frame to the next (audio.hpp); optional. 9 is not used
    patched = 11,     // TP-frame: a T-frame of which a part is replaced; a reference itself
    texture = 12,     // the picture of a frame (texture.hpp); optional
};

// Bits of PacketHeader::flags (docs/bitstream.md, section 2.1), for programs that do not decode the packet.
namespace packet_flag {
inline constexpr std::uint8_t referred = 1;   // frames, pictures: later ones may refer to it
inline constexpr std::uint8_t access = 2;     // frames: it needs no frame but the reference and what that needs;
                                              // pictures: it needs no other
inline constexpr std::uint8_t droppable = 4;  // frames, audio, pictures: it may be left out without affecting others
inline constexpr std::uint8_t colour = 8;     // codebooks: it is for colours, not for geometry
inline constexpr std::uint8_t session = 16;   // sequence headers: the session is not 0
inline constexpr std::uint8_t of_tracked_mesh = 32;  // I-frames: made of the tracked mesh, and not smoothed again
inline constexpr std::uint8_t flags_valid = 128;     // the other bits are valid; encoders of version 1 wrote 0
}  // namespace packet_flag

// A packet without its payload: what dependency.hpp works on.
struct PacketHeader {
    PacketKind kind = PacketKind::sequence;
    std::uint8_t flags = 0;               // of packet_flag
    std::uint16_t reference_version = 0;  // always 0
    std::uint32_t frame = 0;              // number of the frame that it holds, or came with
    std::uint32_t reference = 0;          // number of the frame that it refers to; for an I-frame, its own; for a
                                          // sequence header, the CRC-32 of its payload
    std::int64_t timestamp_us = 0;        // of the frame, microseconds
    bool has(std::uint8_t flag) const { return (flags & flag) != 0; }
};

struct Packet : PacketHeader {
    std::vector<std::uint8_t> payload;
};

inline constexpr std::size_t packet_overhead = 36;  // bytes around the payload: a header of 32 and a CRC of 4

inline constexpr std::size_t packet_header_bytes = 32;

// The header at the beginning of the bytes, or nothing if there is none or its checksum is wrong. payload_bytes: set to
// the size of the payload, which is followed by a CRC of four bytes.
std::optional<PacketHeader> read_packet_header(std::span<const std::uint8_t> bytes, std::uint32_t& payload_bytes);

// The bytes of the packet, ready to be stored or sent.
std::vector<std::uint8_t> write_packet(const Packet& packet);

// Cuts a stream of bytes into packets. Push bytes as they arrive, in pieces of any size, and pull packets until there
// is none. Damage costs only the packets it touches: the reader continues at the next whole packet. Memory is allocated
// for what was pushed, not for what a header claims; if it runs out, std::bad_alloc leaves the reader unchanged.
class PacketReader {
public:
    // Packets with a larger payload are treated as damage.
    explicit PacketReader(std::size_t max_payload = std::size_t{1} << 28) : max_payload_(max_payload) {}
    void push(std::span<const std::uint8_t> bytes);
    // The next whole packet; nothing if more bytes must be pushed first.
    std::optional<Packet> pull();
    // The number of bytes skipped so far, because they are not a packet or belong to one with a wrong CRC.
    std::uint64_t damaged_bytes() const { return damaged_; }
    // The number of packets skipped because their payload is larger than allowed although their header is intact;
    // damage too.
    std::uint64_t oversized_packets() const { return oversized_; }
    // The number of pushed bytes that do not form a packet yet. At the end of a stream they are a truncated packet.
    std::size_t pending_bytes() const { return buffer_.size() - position_; }

private:
    void skip(std::size_t bytes);
    void skip_damaged(std::size_t payload_size);
    std::size_t max_payload_;
    std::vector<std::uint8_t> buffer_;
    std::size_t position_ = 0;
    std::uint64_t damaged_ = 0;
    std::uint64_t oversized_ = 0;
    std::uint64_t checked_in_vain_ = 0;  // payload bytes of packets whose CRC was wrong
};

}  // namespace htvm
