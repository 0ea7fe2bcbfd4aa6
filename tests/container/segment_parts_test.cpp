// Segments that come in parts while they are made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "container/container_streams.h"
#include "container/fragment.h"
#include "htvm/decoder.hpp"

namespace htvm::test {
namespace {

std::vector<StreamSegment> parts_of(const std::vector<Packet>& packets, double seconds, double part_seconds) {
    StreamSegmenter segmenter({.seconds = seconds, .part_seconds = part_seconds});
    std::vector<StreamSegment> out;
    for (const auto& packet : packets) {
        auto part = segmenter.push(packet);
        EXPECT_TRUE(part);
        if (*part) out.push_back(std::move(**part));
    }
    auto rest = segmenter.finish();
    EXPECT_TRUE(rest);
    for (auto& part : *rest) out.push_back(std::move(part));
    return out;
}

// All one after another, as a player that goes on from the first has it.
Bytes joined(const std::vector<StreamSegment>& parts) {
    Bytes out = parts.front().map;
    for (const auto& part : parts) out.insert(out.end(), part.media.begin(), part.media.end());
    return out;
}

TEST(SegmentParts, go_on_until_the_segment_ends_and_are_no_longer_than_told) {
    const auto parts = parts_of(stream_with_all(), 0.16, 0.07);  // segments at 0 and 5, of 5 and 7 frames
    std::vector<int> begins, ends;
    std::vector<std::int64_t> frames;
    for (const auto& part : parts) {
        begins.push_back(part.begins);
        ends.push_back(part.ends);
        frames.push_back(part.begin_us / 33333);
        EXPECT_LE(part.end_us - part.begin_us, 70000);
        EXPECT_EQ(part.map.empty(), !part.begins);
    }
    EXPECT_THAT(frames, testing::ElementsAre(0, 2, 4, 5, 7, 9, 11));
    EXPECT_THAT(begins, testing::ElementsAre(1, 0, 0, 1, 0, 0, 0));
    EXPECT_THAT(ends, testing::ElementsAre(0, 0, 1, 0, 0, 0, 1));
}

TEST(SegmentParts, one_after_the_other_are_the_stream) {
    const auto stream = stream_with_all();
    const auto back = unpacked(joined(parts_of(stream, 0.16, 0.07)));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->damaged, 0u);
    EXPECT_EQ(back->bytes, bytes_of(stream));
}

TEST(SegmentParts, of_a_segment_are_a_stream_with_its_map) {
    const auto parts = parts_of(stream_with_all(), 0.16, 0.07);
    const auto back = unpacked(joined({parts.begin() + 3, parts.end()}));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->damaged, 0u);
    PacketReader reader;
    reader.push(back->bytes);
    std::vector<std::uint32_t> frames;
    while (const auto packet = reader.pull())
        if (frame_type(packet->kind)) frames.push_back(packet->frame);
    EXPECT_THAT(frames, testing::ElementsAre(0, 3, 5, 6, 7, 8, 9, 10, 11));
}

// Its map, which is out, has no entry for it: it is in whole packets until the next segment.
TEST(SegmentParts, have_pictures_of_another_size_as_whole_packets) {
    auto stream = stream_with_all();
    for (auto& packet : stream) {
        if (packet.kind != PacketKind::texture || packet.frame < 8 || packet.frame >= 10) continue;
        TexturePicture picture;
        picture.coder = PictureCoder::av1;
        picture.width = 128;
        picture.height = 32;
        const auto same = picture_packet(8, packet.frame == 8 ? 8 : 7);
        picture.coded = read_texture_picture(same)->coded;
        packet = write_texture_picture(picture, {packet.frame, 8, packet.timestamp_us, true});
    }
    const auto mp4 = joined(parts_of(stream, 0.16, 0.07));
    const auto tables = read_mp4_tables(htvm::source_of(mp4));
    ASSERT_TRUE(tables);
    ASSERT_EQ(tables->tracks[1].kind, SampleTrack::pictures);
    EXPECT_EQ(tables->tracks[1].samples.size(), 8u) << "those of frames 0 to 7: the rest goes on from the other size";
    const auto back = unpacked(mp4);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->damaged, 0u);
    EXPECT_EQ(back->bytes, bytes_of(stream));
    // Whole segments know all before their map is written.
    const auto whole = read_mp4_tables(htvm::source_of(joined(parts_of(stream, 0.16, 0))));
    EXPECT_EQ(whole->tracks[1].samples.size(), 12u);
}

}  // namespace
}  // namespace htvm::test
