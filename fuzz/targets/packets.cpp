// The container: packets come back however the bytes are cut up, and with any noise between them.
#include "whole_decoder.h"

namespace {

using namespace htvm;
using fuzz::require;

bool same(const Packet& a, const Packet& b) {
    return a.kind == b.kind && a.flags == b.flags && a.reference_version == b.reference_version && a.frame == b.frame &&
           a.reference == b.reference && a.timestamp_us == b.timestamp_us && a.payload == b.payload;
}

bool same(const std::vector<Packet>& a, const std::vector<Packet>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return same(x, y); });
}

// Packets chosen by the input with noise between them, some of it truncated packets.
std::vector<std::uint8_t> any_stream(fuzz::FuzzInput& input, std::vector<Packet>& packets) {
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t n = input.below(12); n > 0 && input.left() > 0; --n) {
        const std::uint8_t kind = input.u8();
        if (kind < 64) {
            const auto noise = input.take(input.below(16));
            bytes.insert(bytes.end(), noise.begin(), noise.end());
            continue;
        }
        Packet packet;
        packet.kind = static_cast<PacketKind>(input.u8());
        packet.frame = input.u32();
        packet.reference = input.u32();
        packet.timestamp_us = static_cast<std::int64_t>(input.u64());
        const auto payload = input.take(input.below(64));
        packet.payload.assign(payload.begin(), payload.end());
        const auto written = write_packet(packet);
        const bool whole = kind < 200;
        bytes.insert(bytes.end(), written.begin(),
                     whole ? written.end() : written.begin() + input.below(static_cast<std::uint32_t>(written.size())));
        if (whole) packets.push_back(std::move(packet));
    }
    return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const std::size_t piece = 1 + input.u8();
    std::vector<Packet> written;
    std::vector<std::uint8_t> bytes;
    if (input.flag()) {
        bytes = any_stream(input, written);
    } else {
        const auto rest = input.rest();
        bytes.assign(rest.begin(), rest.end());
        if (piece % 2) fuzz::repair_checksums(bytes);
    }
    const auto packets = fuzz::read_packets(bytes, piece);
    require(same(packets, fuzz::read_packets(bytes, bytes.size() + 1)), "pieces of any size give the same packets");
    std::vector<std::uint8_t> again;
    for (const auto& packet : packets) {
        const auto one = write_packet(packet);
        again.insert(again.end(), one.begin(), one.end());
    }
    require(same(fuzz::read_packets(again, piece), packets), "packets come back as they were written");
    return 0;
}
