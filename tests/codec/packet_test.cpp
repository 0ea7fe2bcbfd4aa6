#include "htvm/packet.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"
#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm::internal {
namespace {

using Bytes = std::vector<std::uint8_t>;

Packet packet_of(std::uint32_t frame, std::size_t size, std::uint8_t fill = 0x5a) {
    Packet packet;
    packet.kind = PacketKind::enhanced;
    packet.frame = frame;
    packet.reference = frame / 2;
    packet.timestamp_us = -1000 * std::int64_t{frame};
    packet.payload.assign(size, fill);
    return packet;
}

void append(Bytes& bytes, const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

std::vector<Packet> read(PacketReader& reader, const Bytes& bytes, std::size_t chunk = std::size_t{1} << 30) {
    std::vector<Packet> out;
    for (std::size_t at = 0; at < bytes.size(); at += chunk) {
        reader.push(std::span(bytes).subspan(at, std::min(chunk, bytes.size() - at)));
        while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    }
    return out;
}

std::vector<std::uint32_t> frames(const std::vector<Packet>& packets) {
    std::vector<std::uint32_t> out;
    for (const auto& packet : packets) out.push_back(packet.frame);
    return out;
}

Bytes three_packets() {
    Bytes bytes;
    for (const std::uint32_t frame : {1u, 2u, 3u}) append(bytes, write_packet(packet_of(frame, 50 * frame)));
    return bytes;
}

TEST(Packet, IsItsPayloadAndThirtySixBytes) {
    EXPECT_EQ(write_packet(packet_of(1, 0)).size(), packet_overhead);
    EXPECT_EQ(write_packet(packet_of(1, 1000)).size(), 1000 + packet_overhead);
}

TEST(Packet, ComesBackInPiecesOfAnySize) {
    std::vector<Packet> packets = {packet_of(0, 0), packet_of(1, 1), packet_of(~0u, 5000)};
    packets[0].kind = PacketKind::sequence;
    packets[0].timestamp_us = std::numeric_limits<std::int64_t>::min();
    packets[1].kind = static_cast<PacketKind>(200);  // of a later version
    packets[1].timestamp_us = std::numeric_limits<std::int64_t>::max();
    Bytes bytes;
    for (const auto& packet : packets) append(bytes, write_packet(packet));
    for (const std::size_t chunk : {1u, 3u, 7u, 36u, 1000u, 100000u}) {
        PacketReader reader;
        const auto out = read(reader, bytes, chunk);
        ASSERT_EQ(out.size(), packets.size());
        for (std::size_t i = 0; i < out.size(); ++i) {
            EXPECT_EQ(out[i].kind, packets[i].kind);
            EXPECT_EQ(out[i].frame, packets[i].frame);
            EXPECT_EQ(out[i].reference, packets[i].reference);
            EXPECT_EQ(out[i].timestamp_us, packets[i].timestamp_us);
            EXPECT_EQ(out[i].payload, packets[i].payload);
        }
        EXPECT_EQ(reader.damaged_bytes(), 0u);
        EXPECT_EQ(reader.pending_bytes(), 0u);
    }
}

TEST(PacketReader, AnyFlippedBitCostsItsPacketAlone) {
    const auto bytes = three_packets();
    const std::size_t begin = 50 + packet_overhead, end = begin + 100 + packet_overhead;
    for (std::size_t bit = begin * 8; bit < end * 8; ++bit) {
        auto damaged = bytes;
        damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << bit % 8));
        PacketReader reader;
        ASSERT_EQ(frames(read(reader, damaged)), (std::vector<std::uint32_t>{1, 3})) << "bit " << bit;
        EXPECT_EQ(reader.damaged_bytes(), end - begin);
    }
}

TEST(PacketReader, BytesLostCostThePacketTheyWereIn) {
    const auto bytes = three_packets();
    const std::size_t begin = 50 + packet_overhead, end = begin + 100 + packet_overhead;
    for (std::size_t at = begin; at < end; ++at) {
        auto damaged = bytes;
        damaged.erase(damaged.begin() + static_cast<std::ptrdiff_t>(at));
        PacketReader reader;
        ASSERT_EQ(frames(read(reader, damaged)), (std::vector<std::uint32_t>{1, 3})) << at;
    }
}

TEST(PacketReader, GarbageBetweenPacketsIsSkipped) {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        Bytes bytes;
        std::size_t garbage = 0;
        for (std::uint32_t frame = 0; frame < 4; ++frame) {
            for (std::uint32_t n = test::below(random, 60); n > 0; --n, ++garbage)
                bytes.push_back(static_cast<std::uint8_t>("HTVPx"[test::below(random, 5)]));
            append(bytes, write_packet(packet_of(frame, test::below(random, 100))));
        }
        PacketReader reader;
        ASSERT_EQ(frames(read(reader, bytes, 1 + test::below(random, 50))), (std::vector<std::uint32_t>{0, 1, 2, 3}));
        EXPECT_EQ(reader.damaged_bytes(), garbage);
    }
}

TEST(PacketReader, APacketCutShortIsPending) {
    const auto bytes = write_packet(packet_of(1, 100));
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        PacketReader reader;
        EXPECT_TRUE(read(reader, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size))).empty());
        EXPECT_EQ(reader.pending_bytes(), size);
        EXPECT_EQ(reader.damaged_bytes(), 0u);
    }
}

TEST(PacketReader, APacketLargerThanAllowedIsDamage) {
    Bytes bytes = write_packet(packet_of(1, 1001));
    append(bytes, write_packet(packet_of(2, 1000)));
    PacketReader reader(1000);
    EXPECT_EQ(frames(read(reader, bytes)), std::vector<std::uint32_t>{2});
}

TEST(PacketReader, APacketInsideADamagedOneIsFound) {
    auto outer = packet_of(1, 0);
    outer.payload = write_packet(packet_of(2, 30));
    outer.payload.resize(outer.payload.size() + 20);
    auto bytes = write_packet(outer);
    bytes.back() = static_cast<std::uint8_t>(bytes.back() + 1);
    append(bytes, write_packet(packet_of(3, 10)));
    PacketReader reader;
    EXPECT_EQ(frames(read(reader, bytes)), (std::vector<std::uint32_t>{2, 3}));
}

// A valid header that promises `size` bytes.
Bytes header_for(std::uint32_t size) {
    auto bytes = write_packet(packet_of(9, 0));
    bytes.resize(32);
    ByteWriter out;
    out.u32(size);
    std::copy(out.data().begin(), out.data().end(), bytes.begin() + 24);
    ByteWriter crc;
    crc.u32(crc32(std::span(bytes).subspan(4, 24)));
    std::copy(crc.data().begin(), crc.data().end(), bytes.begin() + 28);
    return bytes;
}

TEST(PacketReader, HeadersThatEachClaimAllThatFollowsTakeLinearTime) {
    // Every header's CRC is right and its payload's is wrong: checked one by one, this would take hours.
    constexpr std::uint32_t headers = 300000;
    Bytes bytes;
    for (std::uint32_t i = 0; i < headers; ++i) append(bytes, header_for((headers - i - 1) * 32));
    append(bytes, Bytes(4, 0));
    append(bytes, write_packet(packet_of(7, 100)));
    PacketReader reader;
    EXPECT_EQ(frames(read(reader, bytes)), std::vector<std::uint32_t>{7});
}

TEST(PacketReader, NoiseGivesNoPackets) {
    hostile::try_everything(three_packets(), [](const Bytes& bytes) {
        PacketReader reader;
        const auto out = read(reader, bytes);
        std::size_t whole = 0;
        for (const auto& packet : out) whole += packet.payload.size() + packet_overhead;
        EXPECT_EQ(whole + reader.damaged_bytes() + reader.pending_bytes(), bytes.size());
    });
}

}  // namespace
}  // namespace htvm::internal
