#include "htvm/packet.hpp"

#include <algorithm>
#include <array>

#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::array<std::uint8_t, 4> sync = {'H', 'T', 'V', 'P'};
constexpr std::size_t header_size = packet_header_bytes;

}  // namespace

std::optional<PacketHeader> read_packet_header(std::span<const std::uint8_t> bytes, std::uint32_t& payload_bytes) {
    if (bytes.size() < header_size || !std::equal(sync.begin(), sync.end(), bytes.begin())) return std::nullopt;
    ByteReader in(bytes.subspan(sync.size()));
    PacketHeader out;
    out.kind = static_cast<PacketKind>(in.u8());
    out.flags = in.u8();
    out.reference_version = in.u16();
    out.frame = in.u32();
    out.reference = in.u32();
    out.timestamp_us = static_cast<std::int64_t>(in.u64());
    payload_bytes = in.u32();
    if (in.u32() != crc32(bytes.subspan(sync.size(), header_size - 8))) return std::nullopt;
    return out;
}

std::vector<std::uint8_t> write_packet(const Packet& packet) {
    ByteWriter header;
    header.u8(static_cast<std::uint8_t>(packet.kind));
    header.u8(packet.flags);
    header.u16(packet.reference_version);
    header.u32(packet.frame);
    header.u32(packet.reference);
    header.u64(static_cast<std::uint64_t>(packet.timestamp_us));
    header.u32(static_cast<std::uint32_t>(packet.payload.size()));
    ByteWriter out;
    out.bytes(sync);
    out.bytes(header.data());
    out.u32(crc32(header.data()));
    out.bytes(packet.payload);
    out.u32(crc32(packet.payload));
    return out.take();
}

void PacketReader::push(std::span<const std::uint8_t> bytes) {
    if (position_ > 0) {
        buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(position_));
        position_ = 0;
    }
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void PacketReader::skip(std::size_t bytes) {
    damaged_ += bytes;
    position_ += bytes;
}

// Passes over a packet whose header is sound and whose payload is not. What looks like a packet within may be one
// (where bytes were lost, it is the next), so only the header is passed over. A stream made to claim the same bytes
// over and over would take quadratic time that way: once much more was checked than skipped, the payload goes with the
// header.
void PacketReader::skip_damaged(std::size_t payload_size) {
    constexpr std::uint64_t always_affordable = std::uint64_t{1} << 26;
    constexpr std::uint64_t checks_a_byte = 16;
    checked_in_vain_ += payload_size;
    const bool affordable = checked_in_vain_ <= always_affordable + checks_a_byte * damaged_;
    skip(affordable ? header_size : packet_overhead + payload_size);
}

std::optional<Packet> PacketReader::pull() {
    for (;;) {
        // To the next sync word; what could be its beginning at the very end is kept.
        const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(position_);
        const auto found = std::search(begin, buffer_.end(), sync.begin(), sync.end());
        if (found == buffer_.end()) {
            const std::size_t left = pending_bytes();
            std::size_t keep = std::min<std::size_t>(left, sync.size() - 1);
            while (keep > 0 &&
                   !std::equal(buffer_.end() - static_cast<std::ptrdiff_t>(keep), buffer_.end(), sync.begin()))
                --keep;
            skip(left - keep);
            return std::nullopt;
        }
        skip(static_cast<std::size_t>(found - begin));
        if (pending_bytes() < header_size) return std::nullopt;
        const auto bytes = std::span<const std::uint8_t>(buffer_).subspan(position_);
        std::uint32_t payload_bytes = 0;
        const auto header = read_packet_header(bytes, payload_bytes);
        const std::size_t size = payload_bytes;
        if (!header || size > max_payload_) {
            oversized_ += header.has_value();
            skip(1);
            continue;
        }
        if (bytes.size() < header_size + size + 4) return std::nullopt;
        const auto payload = bytes.subspan(header_size, size);
        ByteReader tail(bytes.subspan(header_size + size, 4));
        if (tail.u32() != crc32(payload)) {
            skip_damaged(size);
            continue;
        }
        Packet packet{*header, {payload.begin(), payload.end()}};
        position_ += packet_overhead + size;
        return packet;
    }
}

}  // namespace htvm
