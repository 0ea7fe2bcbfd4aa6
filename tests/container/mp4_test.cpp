#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "container/box.h"
#include "container/container_streams.h"
#include "container/fragment.h"
#include "htvm/decoder.hpp"
#include "htvm/stream_index.hpp"

namespace htvm::test {
namespace {

constexpr std::size_t meshes = 0, pictures = 1, sound = 2;

Packet some_index(std::uint64_t bytes) {
    StreamIndex index;
    index.frames = 12;
    index.bytes = bytes;
    return write_index(index);
}

std::vector<Mp4Track> tables_of(const Bytes& mp4) {
    auto tables = read_mp4_tables(htvm::source_of(mp4));
    EXPECT_TRUE(tables) << tables.error().message;
    return tables ? tables->tracks : std::vector<Mp4Track>();
}

std::vector<std::uint32_t> sync_samples(const Mp4Track& track) {
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i < track.samples.size(); ++i)
        if (track.samples[i].sync) out.push_back(static_cast<std::uint32_t>(i + 1));
    return out;
}

class EitherKind : public testing::TestWithParam<bool> {
protected:
    Mp4Options options() const { return {.fragmented = GetParam(), .fragment_seconds = 0.1}; }
};
INSTANTIATE_TEST_SUITE_P(Mp4, EitherKind, testing::Values(false, true),
                         [](const auto& kind) { return kind.param ? "fragmented" : "progressive"; });

TEST_P(EitherKind, gives_back_the_stream_byte_for_byte) {
    const auto stream = stream_with_all();
    const auto mp4 = mp4_of(stream, options());
    ASSERT_TRUE(mp4) << mp4.error().message;
    const auto back = unpacked(*mp4);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->bytes, bytes_of(stream));
    EXPECT_EQ(back->damaged, 0u);
}

TEST_P(EitherKind, keeps_what_has_no_track_of_its_own) {
    using namespace packet_flag;
    auto stream = stream_with_all();
    auto unknown = frame_packet(static_cast<PacketKind>(77), 3, 3, 0);
    Packet codebook = frame_packet(PacketKind::codebook, 4, 3, 0);
    auto other_coder = sound_packet(5, 1000000 + 5 * 33333);
    other_coder.payload[0] = 9;
    stream.insert(stream.begin() + 1, unknown);
    stream.insert(stream.end(), {codebook, frame_packet(PacketKind::intra, 12, 12, referred | access), other_coder,
                                 picture_packet(12, 12, PictureCoder::png), header_packet()});
    const auto mp4 = mp4_of(stream, options());
    ASSERT_TRUE(mp4) << mp4.error().message;
    EXPECT_EQ(unpacked(*mp4)->bytes, bytes_of(stream));
}

TEST_P(EitherKind, begins_with_the_index) {
    const auto stream = stream_with_all();
    const auto index = some_index(bytes_of(stream).size());
    const auto mp4 = mp4_of(stream, options(), index);
    auto expected = write_packet(index);
    const auto packets = bytes_of(stream);
    expected.insert(expected.end(), packets.begin(), packets.end());
    EXPECT_EQ(unpacked(*mp4)->bytes, expected);
}

TEST_P(EitherKind, has_three_tracks_whose_sync_samples_are_where_decoding_can_start) {
    const auto mp4 = mp4_of(stream_with_all(), options());
    const auto tracks = tables_of(*mp4);
    ASSERT_EQ(tracks.size(), 3u);
    EXPECT_EQ(tracks[meshes].kind, SampleTrack::meshes);
    EXPECT_EQ(tracks[pictures].kind, SampleTrack::pictures);
    EXPECT_EQ(tracks[sound].kind, SampleTrack::sound);
    EXPECT_EQ(tracks[meshes].samples.size(), 12u);
    EXPECT_EQ(tracks[pictures].samples.size(), 12u);
    EXPECT_EQ(tracks[sound].samples.size(), 22u);
    EXPECT_THAT(sync_samples(tracks[meshes]), testing::ElementsAre(1, 4, 6, 7, 10));
    EXPECT_THAT(sync_samples(tracks[pictures]), testing::ElementsAre(1, 7));
    EXPECT_EQ(tracks[meshes].clock, 1000000u);
    EXPECT_EQ(tracks[meshes].samples[5].time, 5u * 33333);
    EXPECT_EQ(tracks[pictures].samples[5].time, 5u * 33333);
    EXPECT_EQ(tracks[sound].clock, 48000u);
    EXPECT_EQ(tracks[sound].samples[21].time, 21u * 960);
}

TEST(Mp4, has_pictures_and_sound_as_their_coders_made_them) {
    const auto mp4 = mp4_of(stream_with_all());
    const auto tracks = tables_of(*mp4);
    const auto bytes = [&](const Mp4Sample& sample) {
        return Bytes(mp4->begin() + static_cast<std::ptrdiff_t>(sample.offset),
                     mp4->begin() + static_cast<std::ptrdiff_t>(sample.offset + sample.size));
    };
    // Without the temporal delimiter, as samples of AV1 are.
    EXPECT_EQ(bytes(tracks[pictures].samples[0]), (Bytes{0x0a, 2, 0x0a, 0, 0x32, 2, 0x10, 0}));
    EXPECT_EQ(bytes(tracks[pictures].samples[1]), (Bytes{0x32, 2, 0x10, 1}));
    EXPECT_EQ(bytes(tracks[sound].samples[0]), (Bytes{0xf8, 0, 1}));
}

// Goes down through boxes; the fields before the boxes inside stsd and sample entries are passed over.
std::span<const std::uint8_t> inside(std::span<const std::uint8_t> bytes, std::initializer_list<std::uint32_t> path) {
    for (const auto type : path) {
        const auto box = find_box(bytes, type);
        EXPECT_TRUE(box) << std::hex << type;
        if (!box) return {};
        const auto fields = type == four("stsd")                                                   ? 8u
                            : type == four("av01") || type == four("avc3") || type == four("htvm") ? 78u
                                                                                                   : 0u;
        bytes = box->inside.subspan(fields);
    }
    return bytes;
}

TEST(Mp4, says_what_the_pictures_are_in_a_record_of_their_first_key_picture) {
    // Only the track of pictures.
    auto stream = stream_with_all();
    const auto mp4 = mp4_of(stream);
    const auto moov = inside(*mp4, {four("moov")});
    BoxReader tracks(moov);
    std::vector<MediaBox> found;
    while (const auto box = tracks.next())
        if (box->type == four("trak")) found.push_back(*box);
    ASSERT_EQ(found.size(), 3u);
    const auto record = inside(found[pictures].inside,
                               {four("mdia"), four("minf"), four("stbl"), four("stsd"), four("av01"), four("av1C")});
    EXPECT_EQ(Bytes(record.begin(), record.end()), (Bytes{0x81, 8, 0x0c, 0, 0x0a, 2, 0x0a, 0}));
    const auto configuration = inside(
        found[meshes].inside, {four("mdia"), four("minf"), four("stbl"), four("stsd"), four("htvm"), four("htvC")});
    const auto header = write_packet(stream[0]);
    EXPECT_EQ(Bytes(configuration.begin() + 8, configuration.end()), header);
}

// The stream of six frames whose pictures are H.264, a key picture at the first.
std::vector<Packet> h264_stream() {
    std::vector<Packet> out = {header_packet()};
    for (std::uint32_t frame = 0; frame < 6; ++frame) {
        using namespace packet_flag;
        const auto kind = frame == 0 ? PacketKind::intra : PacketKind::tracked;
        out.push_back(frame_packet(kind, frame, 0, static_cast<std::uint8_t>(frame == 0 ? referred | access : 0)));
        out.push_back(picture_packet(frame, frame == 0 ? 0 : frame - 1, PictureCoder::h264));
    }
    return out;
}

TEST(Mp4, has_h264_in_an_entry_whose_record_has_its_parameter_sets) {
    const auto stream = h264_stream();
    const auto mp4 = mp4_of(stream);
    const auto tracks = tables_of(*mp4);
    ASSERT_EQ(tracks.size(), 2u);
    EXPECT_EQ(tracks[pictures].kind, SampleTrack::pictures);
    EXPECT_EQ(tracks[pictures].samples.size(), 6u);
    const auto moov = inside(*mp4, {four("moov")});
    BoxReader boxes(moov);
    std::vector<MediaBox> found;
    while (const auto box = boxes.next())
        if (box->type == four("trak")) found.push_back(*box);
    const auto record = inside(found[pictures].inside,
                               {four("mdia"), four("minf"), four("stbl"), four("stsd"), four("avc3"), four("avcC")});
    EXPECT_EQ(Bytes(record.begin(), record.end()),
              (Bytes{1, 100, 0, 31, 0xff, 0xe1, 0, 5, 0x67, 100, 0, 31, 9, 1, 0, 2, 0x68, 5, 0xfd, 0xf8, 0xf8, 0}));
    EXPECT_EQ(unpacked(*mp4)->bytes, bytes_of(stream));
}

TEST(Mp4, keeps_h264_whole_whose_parameter_sets_are_missing_or_of_a_profile_that_streams_have_not) {
    for (const std::size_t place : {std::size_t{5}, std::size_t{3}, std::size_t{4}, std::size_t{13}}) {
        auto stream = h264_stream();
        auto& payload = stream[2].payload;
        const auto coded = payload.size() - 21;
        ASSERT_EQ(payload[coded + 4], 0x67);
        payload[coded + place] = 110;  // the profile; a size beyond the end; another kind of unit, of both sets
        const auto mp4 = mp4_of(stream);
        EXPECT_EQ(tables_of(*mp4).size(), 1u) << place;
        EXPECT_EQ(unpacked(*mp4)->bytes, bytes_of(stream));
    }
}

TEST(Mp4, says_which_samples_an_access_point_needs) {
    const auto mp4 = mp4_of(stream_with_all());
    const auto stbl = inside(*mp4, {four("moov"), four("trak"), four("mdia"), four("minf"), four("stbl")});
    BoxReader groups(inside(stbl, {four("sgpd")}));
    groups.skip(4);
    EXPECT_EQ(groups.u32(), four("htva"));
    groups.skip(4);
    std::vector<std::vector<std::uint32_t>> needs(groups.u32());
    for (auto& numbers : needs) {
        numbers.resize(groups.u32() / 4);
        for (auto& number : numbers) number = groups.u32();
    }
    BoxReader runs(inside(stbl, {four("sbgp")}));
    runs.skip(8);
    std::vector<std::uint32_t> of_samples;
    for (auto left = runs.u32(); left > 0; --left) {
        const auto count = runs.u32(), group = runs.u32();
        of_samples.insert(of_samples.end(), count, group);
    }
    ASSERT_EQ(of_samples.size(), 12u);
    const auto needs_of = [&](std::size_t frame) { return needs.at(of_samples[frame] - 1); };
    EXPECT_EQ(of_samples[1], 0u);
    EXPECT_THAT(needs_of(0), testing::ElementsAre());
    // The pictures up to its own, which needs them; of the meshes, 0 alone.
    EXPECT_THAT(needs_of(3), testing::ElementsAre(1, 2, 3));
    EXPECT_THAT(needs_of(5), testing::ElementsAre(1, 2, 3, 4, 5));
    EXPECT_THAT(needs_of(6), testing::ElementsAre());
    EXPECT_THAT(needs_of(9), testing::ElementsAre(7, 8, 9));
}

TEST(Mp4, without_its_sound_is_the_stream_without_sound) {
    const auto stream = stream_with_all();
    auto mp4 = *mp4_of(stream);
    const Bytes name = {'O', 'p', 'u', 's'};
    const auto at = std::search(mp4.begin(), mp4.end(), name.begin(), name.end());
    ASSERT_NE(at, mp4.end());
    *at = 'X';
    auto expected = stream;
    std::erase_if(expected, [](const Packet& packet) { return packet.kind == PacketKind::audio; });
    const auto back = unpacked(mp4);
    EXPECT_EQ(back->bytes, bytes_of(expected));
    EXPECT_EQ(back->damaged, 0u);
}

TEST(Mp4, of_which_a_picture_is_damaged_lacks_that_picture_alone_and_says_so) {
    const auto stream = stream_with_all();
    auto mp4 = *mp4_of(stream);
    const auto place = tables_of(mp4)[pictures].samples[4].offset;
    mp4[place + 3] ^= 1;
    auto expected = stream;
    std::erase_if(expected, [](const Packet& p) { return p.kind == PacketKind::texture && p.frame == 4; });
    const auto back = unpacked(mp4);
    EXPECT_EQ(back->bytes, bytes_of(expected));
    EXPECT_GT(back->damaged, 0u);
}

TEST(Mp4, of_other_contents_is_refused_with_words) {
    auto mp4 = *mp4_of(stream_with_all());
    const Bytes name = {'h', 't', 'v', 'm', 0, 0, 0, 0, 0, 0, 0, 1};
    const auto at = std::search(mp4.begin(), mp4.end(), name.begin(), name.end());
    ASSERT_NE(at, mp4.end());
    *at = 'X';
    const auto back = unpacked(mp4);
    ASSERT_FALSE(back);
    EXPECT_THAT(back.error().message, testing::HasSubstr("no track of meshes"));
    EXPECT_FALSE(mp4_of({header_packet()}, {})->empty()) << "a stream without a frame has a sample of packets";
}

TEST(Mp4, cut_short_gives_the_frames_that_are_whole_and_says_what_is_missing) {
    for (const bool fragmented : {false, true}) {
        const auto stream = bytes_of(stream_with_all());
        const auto mp4 = *mp4_of(stream_with_all(), {.fragmented = fragmented, .fragment_seconds = 0.1});
        std::set<std::size_t> lengths;  // of what comes back
        for (std::size_t size = 0; size < mp4.size(); ++size) {
            const auto back = unpacked(std::span(mp4).first(size));
            if (!back) continue;
            ASSERT_LT(back->bytes.size(), stream.size());
            ASSERT_TRUE(back->missing > 0 || fragmented) << size;
            lengths.insert(back->bytes.size());
            if (!fragmented) {
                ASSERT_EQ(back->missing, mp4.size() - size);
            }
            // Nothing is damaged but what lies in part behind the end.
            if (!fragmented) {
                ASSERT_EQ(back->damaged, back->cut_off) << size;
            }
            if (back->damaged != 0) continue;
            ASSERT_TRUE(std::equal(back->bytes.begin(), back->bytes.end(), stream.begin())) << size;
        }
        EXPECT_GE(lengths.size(), 12u) << "each frame makes it longer";
    }
}

TEST(Mp4, with_any_byte_changed_is_read_without_harm) {
    for (const bool fragmented : {false, true}) {
        const auto mp4 = *mp4_of(stream_with_all(), {.fragmented = fragmented, .fragment_seconds = 0.1});
        for (std::size_t at = 0; at < mp4.size(); ++at)
            for (const int value : {0, 0xff}) {
                auto changed = mp4;
                changed[at] = static_cast<std::uint8_t>(value);
                const auto back = unpacked(changed);
                ASSERT_LE(back ? back->bytes.size() : 0, 2 * mp4.size());
            }
    }
}

TEST(Mp4, whose_samples_lie_over_each_other_is_refused) {
    auto mp4 = *mp4_of(stream_with_all());
    const Bytes name = {'s', 't', 's', 'z'};
    const auto at = std::search(mp4.begin(), mp4.end(), name.begin(), name.end());
    // The sizes of meshes: each sample as large as half of the file.
    const auto count = static_cast<std::size_t>(at - mp4.begin()) + 12;
    for (std::size_t i = 0; i < 3; ++i) {
        mp4[count + 4 + 4 * i + 2] = static_cast<std::uint8_t>(mp4.size() / 512);
    }
    const auto back = unpacked(mp4);
    ASSERT_FALSE(back);
    EXPECT_THAT(back.error().message, testing::HasSubstr("samples lie"));
}

// ---- Segments -------------------------------------------------------------------------------------------------------

std::vector<StreamSegment> segments_of(const std::vector<Packet>& packets, double seconds) {
    StreamSegmenter segmenter({.seconds = seconds});
    std::vector<StreamSegment> out;
    for (const auto& packet : packets) {
        auto segment = segmenter.push(packet);
        EXPECT_TRUE(segment);
        if (*segment) out.push_back(std::move(**segment));
    }
    auto rest = segmenter.finish();
    EXPECT_TRUE(rest);
    for (auto& segment : *rest) out.push_back(std::move(segment));
    return out;
}

Bytes file_of(const StreamSegment& segment) {
    auto out = segment.map;
    out.insert(out.end(), segment.media.begin(), segment.media.end());
    return out;
}

TEST(Segments, begin_where_decoding_can_start_and_are_at_least_as_long_as_asked) {
    const auto segments = segments_of(stream_with_all(), 0.09);
    std::vector<std::int64_t> begins;
    for (const auto& segment : segments) begins.push_back(segment.begin_us / 33333);
    EXPECT_THAT(begins, testing::ElementsAre(0, 3, 6, 9));
    for (std::size_t i = 1; i < segments.size(); ++i) EXPECT_EQ(segments[i - 1].end_us, segments[i].begin_us);
    EXPECT_NEAR(static_cast<double>(segments.back().end_us), 12 * 33333, 2);
}

TEST(Segments, one_after_the_other_are_the_stream) {
    const auto stream = stream_with_all();
    Bytes all;
    for (const auto& segment : segments_of(stream, 0.1)) {
        const auto part = unpacked(file_of(segment), !all.empty());
        ASSERT_TRUE(part) << part.error().message;
        all.insert(all.end(), part->bytes.begin(), part->bytes.end());
    }
    EXPECT_EQ(all, bytes_of(stream));
}

TEST(Segments, come_with_a_map_that_has_what_their_first_frame_needs) {
    const auto stream = stream_with_all();
    const auto segments = segments_of(stream, 0.16);  // at 0, 5 and 10... which are 0, 5, and none behind
    ASSERT_EQ(segments.size(), 2u);
    const auto back = unpacked(file_of(segments[1]));
    ASSERT_TRUE(back);
    PacketReader reader;
    reader.push(back->bytes);
    std::vector<PacketHeader> headers;
    while (const auto packet = reader.pull()) headers.push_back(*packet);
    const auto first = std::find_if(headers.begin(), headers.end(), [](const PacketHeader& header) {
        return frame_type(header.kind) && header.frame == 5;
    });
    ASSERT_NE(first, headers.end());
    const auto needed = closure(headers, static_cast<std::size_t>(first - headers.begin()));
    std::vector<std::uint32_t> frames;
    for (const auto place : needed)
        if (frame_type(headers[place].kind)) frames.push_back(headers[place].frame);
    EXPECT_THAT(frames, testing::ElementsAre(0, 3, 5));
    const auto picture = closure(headers, static_cast<std::size_t>(first - headers.begin()) + 1);
    EXPECT_EQ(picture.size(), 7u) << "the header and the pictures 0 to 5";
    // Behind it, all frames.
    EXPECT_EQ(std::count_if(first, headers.end(), [](const auto& h) { return frame_type(h.kind).has_value(); }), 7);
}

TEST(Segments, of_the_same_reference_have_the_same_map) {
    std::vector<Packet> stream;
    for (const auto& packet : stream_with_all())
        if (packet.kind != PacketKind::texture && packet.kind != PacketKind::audio && packet.frame < 6)
            stream.push_back(packet);
    using namespace packet_flag;
    for (std::uint32_t frame = 6; frame < 12; ++frame)
        stream.push_back(frame_packet(PacketKind::tracked, frame, frame % 3 == 0 ? 3 : frame - 1,
                                      static_cast<std::uint8_t>(referred | (frame % 3 == 0 ? access : 0))));
    const auto segments = segments_of(stream, 0.06);  // at 0, 3, 5, 6... of at least two frames: 0, 3, 5, 9
    ASSERT_EQ(segments.size(), 4u);
    EXPECT_NE(segments[0].map, segments[1].map);
    EXPECT_NE(segments[1].map, segments[2].map);
    EXPECT_EQ(segments[2].map, segments[3].map);
}

}  // namespace
}  // namespace htvm::test
