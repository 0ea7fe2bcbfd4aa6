// The index in front of a file: it comes back, says where decoding can start, and its offsets hold behind it.
#include "htvm/stream_index.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "codec/enhanced_options.h"
#include "codec/hostile_bytes.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

StreamIndex full_index() {
    StreamIndex out;
    out.frames = 1000;
    out.first_timestamp_us = -5;
    out.duration_us = 33333333;
    out.bytes = 1 << 20;
    out.bounds = SpaceBounds{{-1.5f, 0, -300}, {2, 1900, 300}};
    out.sequences = {{0, 0}, {500000, 500}};
    for (std::uint32_t i = 0; i < 30; ++i)
        out.points.push_back({30 * i, -5 + 1000000 * std::int64_t{i}, 90 + 12345 * i, i % 3, packet_flag::flags_valid});
    return out;
}

void expect_comes_back(const StreamIndex& index) {
    const auto read = read_index(write_index(index));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(*read, index);
}

TEST(FrontIndex, ComesBack) {
    expect_comes_back({});
    auto index = full_index();
    for (auto& point : index.points) point.back = std::min(point.back, static_cast<std::uint32_t>(point.frame / 30));
    expect_comes_back(index);
    index.bounds.reset();
    expect_comes_back(index);
    constexpr auto low = std::numeric_limits<std::int64_t>::min(), high = std::numeric_limits<std::int64_t>::max();
    index.points = {{0, low, 0}, {1, high, 1}, {999, low, (1 << 20) - 1}};
    expect_comes_back(index);
}

TEST(FrontIndex, ThatContradictsItselfIsRefused) {
    const auto expect_refused = [](const StreamIndex& index, const char* why) {
        const auto read = read_index(write_index(index));
        ASSERT_FALSE(read.has_value()) << why;
        EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream) << why;
    };
    StreamIndex index;
    index.frames = index.bytes = 100;
    index.points = {{5, 0, 5}, {5, 0, 6}};
    expect_refused(index, "a frame twice");
    index.points = {{5, 0, 5}, {6, 0, 5}};
    expect_refused(index, "a packet twice");
    index.points = {{5, 0, 100}};
    expect_refused(index, "behind the end");
    index.points = {{100, 0, 5}};
    expect_refused(index, "a frame that is not there");
    index.points = {{5, 0, 5, 1}};
    expect_refused(index, "refers to what is not there");
    index.points.clear();
    index.sequences = {{100, 0}};
    expect_refused(index, "a sequence behind the end");
    index.sequences.clear();
    index.bounds = SpaceBounds{{1, 0, 0}, {0, 0, 0}};
    expect_refused(index, "bounds inside out");
}

TEST(FrontIndex, DamageIsSurvived) {
    auto index = full_index();
    for (auto& point : index.points) point.back = 0;
    auto packet = write_index(index);
    hostile::try_everything(packet.payload, [&](const std::vector<std::uint8_t>& bytes) {
        packet.payload = bytes;
        const auto read = read_index(packet);
        EXPECT_TRUE(!read || read->points.size() <= bytes.size());
    });
}

std::vector<std::uint8_t> written(const std::vector<Packet>& packets, StreamIndex& index) {
    std::vector<std::uint8_t> out;
    StreamIndexer indexer;
    for (const auto& packet : packets) {
        if (packet.kind == PacketKind::index) continue;
        indexer.add(packet, out.size());
        const auto bytes = write_packet(packet);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    index = indexer.finish(out.size());
    return out;
}

TEST(FrontIndex, SaysWhereDecodingCanStart) {
    auto options = default_options(Profile::tracked);
    options.key_interval = 3;
    auto sequence = synthetic(false, 0);
    for (int t = 0; t < 8; ++t) sequence.frames.push_back({synthetic_frame(300, 50 + t).mesh, {}});
    sequence.frames[4].mesh = {};
    const auto coded = encode(sequence, options);
    auto twice = coded.packets;  // joined with itself: two sequences, numbered on
    twice.insert(twice.end(), coded.packets.begin(), coded.packets.end());
    StreamIndex index;
    const auto bytes = written(twice, index);
    EXPECT_EQ(index.frames, 16u);
    EXPECT_EQ(index.bytes, bytes.size());
    EXPECT_EQ(index.first_timestamp_us, -40000 + 33333);
    EXPECT_NEAR(static_cast<double>(index.duration_us), 16 * 33333, 2);
    ASSERT_EQ(index.sequences.size(), 2u);
    EXPECT_EQ(index.sequences[1].first_frame, 8u);
    for (std::uint64_t frame = 0; frame < 16; ++frame) {
        SCOPED_TRACE(frame);
        const auto* point = point_before(index, frame);
        ASSERT_NE(point, nullptr);
        EXPECT_LE(point->frame, frame);
        EXPECT_GE(point->frame, frame / 8 * 8 + frame % 8 / 3 * 3);  // an I-frame at least
        const auto* header = sequence_of(index, *point);
        ASSERT_NE(header, nullptr);
        PacketReader reader;
        reader.push(std::span(bytes).subspan(header->offset));
        Decoder decoder;
        const auto sequence_header = reader.pull();
        ASSERT_EQ(sequence_header->kind, PacketKind::sequence);
        ASSERT_TRUE(decoder.decode_copy(*sequence_header).has_value());
        const auto first_frame_at = [&](std::uint64_t offset) {
            reader = PacketReader();
            reader.push(std::span(bytes).subspan(offset));
            return *reader.pull();
        };
        std::vector<Packet> needed;
        for (const auto* at = point; at->back > 0;) needed.push_back(first_frame_at((at -= at->back)->offset));
        for (; !needed.empty(); needed.pop_back()) ASSERT_TRUE(decoder.decode_copy(needed.back()).has_value());
        reader = PacketReader();
        reader.push(std::span(bytes).subspan(point->offset));
        for (auto next = point->frame; next <= frame; ++next) {
            auto packet = reader.pull();
            while (!frame_type(packet->kind)) packet = reader.pull();
            const auto decoded = decoder.decode_copy(*packet);
            ASSERT_TRUE(decoded.has_value() && decoded->has_value());
            expect_same_mesh((*decoded)->mesh, coded.reconstructions[next % 8]);
        }
        EXPECT_EQ(reader.damaged_bytes(), 0u);
    }
}

TEST(FrontIndex, OfIntraFramesAloneLeadsToEachOfThem) {
    auto options = test::enhanced_options();
    options.key_interval = 1;
    StreamIndex index;
    written(encode(synthetic(false, 3, 200), options).packets, index);
    ASSERT_EQ(index.points.size(), 3u);
    for (std::uint64_t frame = 0; frame < 3; ++frame) EXPECT_EQ(point_before(index, frame)->frame, frame);
}

TEST(FrontIndex, BoundsHoldAllThatWasAdded) {
    StreamIndexer indexer;
    EXPECT_FALSE(StreamIndexer().finish(0).bounds.has_value());
    indexer.add(SpaceBounds{{0, -1, 5}, {1, 1, 6}});
    indexer.add(SpaceBounds{{-2, 0, 5}, {0, 3, 5}});
    EXPECT_EQ(indexer.finish(0).bounds, (SpaceBounds{{-2, -1, 5}, {1, 3, 6}}));
}

}  // namespace
}  // namespace htvm::internal
