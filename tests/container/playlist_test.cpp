#include "container/playlist.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace htvm::test {
namespace {

Playlist three_segments() {
    Playlist out;
    out.target_seconds = 2;
    out.segments = {{"000000-aa.m4s", "map-1.mp4", 2.000123},
                    {"000001-bb.m4s", "map-1.mp4", 2.5},
                    {"000002-cc.m4s", "map-2.mp4", 0.3}};
    return out;
}

TEST(Playlist, of_a_whole_stream_lists_its_segments_and_says_each_map_once) {
    EXPECT_EQ(write_playlist(three_segments()),
              "#EXTM3U\n"
              "#EXT-X-VERSION:7\n"
              "#EXT-X-TARGETDURATION:3\n"
              "#EXT-X-MEDIA-SEQUENCE:0\n"
              "#EXT-X-PLAYLIST-TYPE:VOD\n"
              "#EXT-X-INDEPENDENT-SEGMENTS\n"
              "#EXT-X-MAP:URI=\"map-1.mp4\"\n"
              "#EXTINF:2.000123,\n"
              "000000-aa.m4s\n"
              "#EXTINF:2.500000,\n"
              "000001-bb.m4s\n"
              "#EXT-X-MAP:URI=\"map-2.mp4\"\n"
              "#EXTINF:0.300000,\n"
              "000002-cc.m4s\n"
              "#EXT-X-ENDLIST\n");
}

TEST(Playlist, of_a_window_has_no_type_and_no_end) {
    auto list = three_segments();
    list.kind = PlaylistKind::window;
    list.has_end = false;
    list.first_number = 41;
    const auto text = write_playlist(list);
    EXPECT_THAT(text, testing::HasSubstr("#EXT-X-MEDIA-SEQUENCE:41\n"));
    EXPECT_THAT(text, testing::Not(testing::HasSubstr("PLAYLIST-TYPE")));
    EXPECT_THAT(text, testing::Not(testing::HasSubstr("ENDLIST")));
}

TEST(Playlist, is_read_as_it_was_written) {
    for (const auto kind : {PlaylistKind::whole, PlaylistKind::event, PlaylistKind::window}) {
        auto list = three_segments();
        list.kind = kind;
        list.has_end = kind != PlaylistKind::window;
        list.first_number = 7;
        const auto back = read_playlist(write_playlist(list));
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->kind, kind);
        EXPECT_EQ(back->has_end, list.has_end);
        EXPECT_EQ(back->first_number, 7u);
        ASSERT_EQ(back->segments.size(), 3u);
        EXPECT_EQ(back->segments[2].uri, "000002-cc.m4s");
        EXPECT_EQ(back->segments[1].map_uri, "map-1.mp4");
        EXPECT_NEAR(back->segments[0].seconds, 2.000123, 1e-9);
    }
}

TEST(Playlist, that_is_none_is_refused_with_words) {
    const std::vector<std::pair<const char*, const char*>> cases = {
        {"", "does not begin"},
        {"<html>", "does not begin"},
        {"#EXTM3U\na.m4s\n", "without #EXTINF"},
        {"#EXTM3U\n#EXTINF:2,\na.m4s\n", "without #EXT-X-MAP"},
        {"#EXTM3U\n#EXTINF:two,\n", "a number that is none"},
        {"#EXTM3U\n#EXTINF:1e9999,\n#EXT-X-MEDIA-SEQUENCE:99999999999999999999\n", "a number that is none"},
        {"#EXTM3U\n#EXT-X-MAP:URI=\"\n", "a map without a name"},
        {"#EXTM3U\n#EXT-X-STREAM-INF:BANDWIDTH=1\nlow.m3u8\n", "not read here"},
        {"#EXTM3U\n#EXT-X-KEY:METHOD=AES-128,URI=\"k\"\n", "not read here"},
    };
    for (const auto& [text, words] : cases) {
        const auto list = read_playlist(text);
        ASSERT_FALSE(list) << text;
        EXPECT_THAT(list.error().message, testing::HasSubstr(words));
    }
}

TEST(A_list_of_playlists, tells_of_each_quality_what_a_player_chooses_by) {
    const std::vector<PlaylistVariant> variants = {{"low.m3u8", 400000, 300000, 512, 512, "htvm,av01.0.04M.08", 30},
                                                   {"high.m3u8", 2500000, 2000000, 0, 0, "htvm", 0}};
    const auto text = write_variants(variants);
    EXPECT_EQ(text,
              "#EXTM3U\n"
              "#EXT-X-VERSION:7\n"
              "#EXT-X-INDEPENDENT-SEGMENTS\n"
              "#EXT-X-STREAM-INF:BANDWIDTH=400000,AVERAGE-BANDWIDTH=300000,RESOLUTION=512x512,"
              "CODECS=\"htvm,av01.0.04M.08\",FRAME-RATE=30.000\n"
              "low.m3u8\n"
              "#EXT-X-STREAM-INF:BANDWIDTH=2500000,AVERAGE-BANDWIDTH=2000000,CODECS=\"htvm\"\n"
              "high.m3u8\n");
    const auto back = read_variants(text);
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[0].uri, "low.m3u8");
    EXPECT_EQ(back[0].bits_per_second, 400000u);
    EXPECT_EQ(back[0].average, 300000u);
    EXPECT_EQ(back[0].codecs, "htvm,av01.0.04M.08");
    EXPECT_EQ(back[1].bits_per_second, 2500000u);
    EXPECT_TRUE(read_variants(write_playlist(three_segments())).empty());
}

TEST(Playlist, names_only_files_beside_it) {
    for (const char* name : {"a.m4s", "low/a.m4s", "..a"}) EXPECT_TRUE(is_name_below(name)) << name;
    for (const char* name :
         {"", "/a", "../a", "low/../../a", "a/", "a//b", "./a", "http://host/a", "c:a", "a?b", "a%2e"})
        EXPECT_FALSE(is_name_below(name)) << name;
}

TEST(Playlist, names_contents_so_that_other_contents_have_another_name) {
    const std::vector<std::uint8_t> one = {1, 2, 3}, other = {1, 2, 4};
    EXPECT_EQ(name_by_content(one), name_by_content(one));
    EXPECT_NE(name_by_content(one), name_by_content(other));
    EXPECT_EQ(name_by_content(one).size(), 24u);
}

}  // namespace
}  // namespace htvm::test
