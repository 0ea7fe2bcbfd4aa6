// Live streams as segments and playlists, from a hub's memory.
#include "live/server/live_segments.h"

#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <limits>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "container/mp4_packets.h"
#include "container/playlist.h"
#include "live/hub/stream_name.h"
#include "live/server/credentials.h"
#include "live_packets.h"
#include "server_test.h"

namespace htvm::live {
namespace {

using State = LiveSegments::Found::State;
using Bytes = std::vector<std::uint8_t>;

class LiveSegmentsTest : public testing::Test {
protected:
    void begin(const LiveSegmentOptions& options, const HubLimits& limits = {}) {
        segments.reset();
        hub.emplace(limits);
        segments.emplace(options, *hub);
        publisher = *hub->publish(
            "anna", [] {}, now);
    }
    void send(const Packet& packet) {
        const auto bytes = write_packet(packet);
        sent.insert(sent.end(), bytes.begin(), bytes.end());
        static_cast<void>(hub->receive_packet(publisher, bytes, now));
    }
    // 30 a second; every 30th can be decoded by itself.
    void send_frames(std::uint32_t first, std::uint32_t end, std::size_t bytes = 100) {
        for (auto frame = first; frame < end; ++frame)
            send(frame % 30 == 0 ? live_intra(frame, bytes) : live_tracked(frame, bytes));
    }
    std::string text() {
        const auto found = segments->playlist("anna", {}, [] {});
        return found.state == State::there ? std::string(found.content) : "";
    }
    Playlist list() { return read_playlist(text()).value(); }
    std::string content(const std::string& name) {
        const auto found = segments->file("anna", name, [] {});
        return found.state == State::there ? std::string(found.content) : "";
    }
    // What a player has that takes all that the playlist names.
    Bytes stream() {
        std::string all, map;
        for (const auto& segment : list().segments) {
            if (segment.map_uri != map) all += content(segment.map_uri);
            map = segment.map_uri;
            all += content(segment.uri);
        }
        const Bytes bytes(all.begin(), all.end());
        auto packets = Mp4Packets::open(source_of(bytes), std::uint64_t{1} << 30);
        Bytes out;
        while (const auto next = packets->next()) out.insert(out.end(), next->begin(), next->end());
        return out;
    }

    Hub::Clock::time_point now{};
    std::optional<Hub> hub;
    std::optional<LiveSegments> segments;
    Hub::Publisher publisher;
    Bytes sent;
};

TEST_F(LiveSegmentsTest, AStreamThatEndsIsThereByteForByte) {
    begin({.seconds = 1});
    send(live_header(1));
    send_frames(0, 75);
    EXPECT_EQ(list().segments.size(), 2u);
    EXPECT_NEAR(list().segments[0].seconds, 1, 1e-4);
    EXPECT_FALSE(list().has_end);
    hub->leave(publisher, true, now);
    EXPECT_EQ(list().segments.size(), 3u);
    EXPECT_TRUE(list().has_end);
    EXPECT_EQ(stream(), sent);
}

TEST_F(LiveSegmentsTest, AStreamShorterThanASegmentIsThereOnceItFallsSilent) {
    begin({.seconds = 2});
    send(live_header(1));
    send_frames(0, 20);
    segments->tick(now += std::chrono::milliseconds(1900));
    EXPECT_EQ(text(), "") << "more may come";
    segments->tick(now += std::chrono::milliseconds(200));
    ASSERT_EQ(list().segments.size(), 1u);
    EXPECT_FALSE(list().has_end);
    EXPECT_EQ(stream(), sent);
    // It goes on where decoding can start.
    send_frames(20, 100);
    EXPECT_EQ(list().segments.size(), 2u);
    EXPECT_NE(text().find("#EXT-X-DISCONTINUITY\n"), std::string::npos);
}

TEST_F(LiveSegmentsTest, DatesSayWhenTheFirstFrameCame) {
    const auto before = std::chrono::system_clock::now();
    begin({.seconds = 1});
    send(live_header(1));
    send_frames(0, 75);
    hub->leave(publisher, true, now);
    const auto all = text();
    int dates = 0;
    for (std::size_t at = 0; (at = all.find("DATE-TIME:", at)) != std::string::npos; ++dates) {
        std::tm parts{};
        ASSERT_NE(strptime(all.c_str() + (at += 10), "%Y-%m-%dT%H:%M:%S", &parts), nullptr);
        const auto date = std::chrono::system_clock::from_time_t(timegm(&parts));
        EXPECT_GE(date, std::chrono::floor<std::chrono::seconds>(before)) << "frames of 2.5 s came at once";
    }
    EXPECT_EQ(dates, 3);
}

TEST_F(LiveSegmentsTest, WhatLeavesTheWindowCanBeFetchedAsLongAgain) {
    begin({.seconds = 1, .window_seconds = 3});
    send(live_header(1));
    send_frames(0, 32);
    const auto first = list();
    send_frames(32, 122);
    EXPECT_EQ(list().segments.size(), 4u);
    send_frames(122, 152);
    EXPECT_EQ(list().segments.size(), 4u);
    EXPECT_EQ(list().first_number, first.first_number + 1);
    EXPECT_NE(content(first.segments[0].uri), "");
    send_frames(152, 302);
    EXPECT_EQ(content(first.segments[0].uri), "");
    EXPECT_NE(content(first.segments[0].map_uri), "") << "it is the others', too";
}

TEST_F(LiveSegmentsTest, AnotherSessionBeginsItsTimesAnew) {
    begin({.seconds = 1});
    send(live_header(1));
    send_frames(0, 40);
    send(live_header(2, 50));
    send_frames(0, 40);
    hub->leave(publisher, true, now);
    const auto text = this->text();
    EXPECT_EQ(list().segments.size(), 4u);
    const auto anew = text.find("#EXT-X-DISCONTINUITY\n");
    ASSERT_NE(anew, std::string::npos);
    EXPECT_EQ(text.find("#EXT-X-DISCONTINUITY\n", anew + 1), std::string::npos);
    EXPECT_EQ(stream(), sent);
}

TEST_F(LiveSegmentsTest, PartsOneAfterAnotherAreTheSegment) {
    begin({.seconds = 1, .part_seconds = 0.34});
    send(live_header(1));
    send_frames(0, 50);
    const auto text = this->text();
    const std::regex part("#EXT-X-PART:DURATION=([0-9.]+),URI=\"([^\"]+)\"(,INDEPENDENT=YES)?");
    std::string parts;
    std::vector<std::string> independent;
    for (std::sregex_iterator at(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find("#EXTINF")), part),
         end;
         at != end; ++at) {
        EXPECT_LE(std::stod((*at)[1]), 0.34);
        parts += content((*at)[2]);
        independent.push_back((*at)[3]);
    }
    EXPECT_EQ(independent, (std::vector<std::string>{",INDEPENDENT=YES", "", ""}));
    EXPECT_EQ(parts, content(list().segments[0].uri));
    EXPECT_NE(text.find("#EXT-X-PART:", text.find("#EXTINF")), std::string::npos) << "the next segment's first part";
    hub->leave(publisher, true, now);
    EXPECT_EQ(stream(), sent);
}

TEST_F(LiveSegmentsTest, WhoAsksForTheNextPartWaitsForIt) {
    begin({.seconds = 1, .part_seconds = 0.34, .waiting = 2});
    send(live_header(1));
    send_frames(0, 45);
    const auto number = list().first_number + 1;  // of the segment of which one part is there
    int woken = 0;
    const auto wake = [&] { ++woken; };
    EXPECT_EQ(segments->playlist("anna", LiveSegments::Position{number, 0}, wake).state, State::there);
    const auto next = segments->playlist("anna", LiveSegments::Position{number, 1}, wake);
    EXPECT_EQ(next.state, State::waits);
    EXPECT_EQ(segments->playlist("anna", LiveSegments::Position{number + 3, 0}, wake).state, State::too_far);
    const auto text = this->text();
    std::smatch hint;
    ASSERT_TRUE(std::regex_search(text, hint, std::regex("PRELOAD-HINT:TYPE=PART,URI=\"([^\"]+)\"")));
    const auto part = segments->file("anna", hint[1], wake);
    EXPECT_EQ(part.state, State::waits);
    EXPECT_EQ(segments->file("anna", hint[1], wake).state, State::too_many);
    EXPECT_EQ(segments->counters().waiting, 2u);
    EXPECT_EQ(woken, 0);
    send_frames(45, 54);
    EXPECT_EQ(woken, 2);
    EXPECT_NE(content(hint[1]), "");
    EXPECT_EQ(segments->playlist("anna", LiveSegments::Position{number, 1}, wake).state, State::there);
}

TEST_F(LiveSegmentsTest, SegmentsCountAsTheStreamsMemoryUntilItIsForgotten) {
    begin({.seconds = 1, .remembered = std::chrono::milliseconds(1000)});
    const auto before = hub->counters().memory;
    send(live_header(1));
    send_frames(0, 92, 10000);
    EXPECT_GT(hub->counters().memory, before + 900000) << "three segments of 300 kB";
    hub->leave(publisher, true, now);
    EXPECT_EQ(hub->counters().memory, segments->counters().held_bytes);
    segments->tick(Hub::Clock::now() + std::chrono::seconds(2));
    EXPECT_EQ(text(), "");
    EXPECT_EQ(hub->counters().memory, 0u);
}

TEST_F(LiveSegmentsTest, AStreamOverItsBytesKeepsFewerSeconds) {
    begin({.seconds = 1, .stream_bytes = 2000000});
    send(live_header(1));
    send_frames(0, 302, 10000);
    EXPECT_LE(segments->counters().held_bytes, 2000000u);
    EXPECT_EQ(list().segments.size(), 6u) << "of 300 kB each";
}

TEST_F(LiveSegmentsTest, AStreamWithoutAPlaceToStartIsGivenUpAndGoesOnAtTheNext) {
    begin({.seconds = 1, .stream_bytes = 1000000});
    send(live_header(1));
    send(live_intra(0));
    for (std::uint32_t frame = 1; frame < 100; ++frame) send(live_tracked(frame, 10000));
    EXPECT_GT(segments->counters().lost, 0u);
    EXPECT_LT(segments->counters().held_bytes, 1000000u);
    send_frames(120, 152);
    EXPECT_EQ(list().segments.size(), 1u);
}

TEST_F(LiveSegmentsTest, ManySequenceHeadersTakeNoMemoryForEver) {
    begin({.seconds = 1});
    for (std::uint32_t session = 1; session < 300; ++session) {
        send(live_header(session, 2000 + session));
        send(live_intra(0));
    }
    hub->leave(publisher, true, now);
    EXPECT_LT(hub->counters().memory, 3000000u);
}

TEST_F(LiveSegmentsTest, AStreamThatGivesWayLosesItsSegments) {
    begin({.seconds = 1}, {.memory = 1800000, .stream_memory = 3000000});
    send(live_header(1));
    send_frames(0, 92, 10000);
    const auto number = list().first_number;
    auto other = *hub->publish(
        "berta", [] {}, now);
    ASSERT_TRUE(hub->receive_packet(other, write_packet(live_header(2)), now));
    for (std::uint32_t frame = 0; frame < 200; ++frame)
        static_cast<void>(hub->receive_packet(other, write_packet(live_intra(frame, 10000)), now));
    EXPECT_GT(hub->counters().gave_way, 0u);
    EXPECT_EQ(text(), "") << "it waits for the next segment";
    now += std::chrono::seconds(2);
    send_frames(120, 152);
    EXPECT_GT(list().first_number, number);
}

// ---- Ladders
// ---------------------------------------------------------------------------------------------------------

TEST(StreamName, ARungHasItsNumberBehindTheLaddersName) {
    EXPECT_EQ(rung_name("anna", 2), "anna~2");
    EXPECT_EQ(ladder_of("anna~2"), "anna");
    for (const char* name : {"anna", "anna~0", "anna~9", "anna~12", "~"}) EXPECT_EQ(ladder_of(name), name);
    for (const auto& name : {std::string("anna~1"), std::string("a~8"), std::string(64, 'a') + "~1"})
        EXPECT_TRUE(is_stream_name(name)) << name;
    for (const char* name : {"~1", "anna~", "anna~0", "anna~9", "anna~1~2", "an~na", ".a~1"})
        EXPECT_FALSE(is_stream_name(name)) << name;
}

class LiveLadderTest : public testing::Test {
protected:
    void publish(const std::string& name, std::uint64_t session) {
        rungs[name] = *hub.publish(
            name, [] {}, now);
        send(name, readable_header(session, 30));
    }
    void send(const std::string& name, const Packet& packet) {
        ASSERT_TRUE(hub.receive_packet(rungs[name], write_packet(packet), now));
    }
    // 30 a second; the first one and each that begins a second can be decoded by itself.
    void send_frames(const std::string& name, std::uint32_t first, std::uint32_t end, std::size_t bytes) {
        for (auto frame = first; frame < end; ++frame) {
            auto packet = frame == first || frame % 30 == 0 ? live_intra(frame, bytes) : live_tracked(frame, bytes);
            packet.timestamp_us = std::int64_t{1000000} * frame / 30;
            send(name, packet);
        }
    }
    std::string text(const std::string& name) {
        return std::string(segments.playlist(name, {}, [] {}).content);
    }
    Playlist list(const std::string& name) { return read_playlist(text(name)).value(); }
    static std::vector<std::string> dates_in(const std::string& text) {
        std::vector<std::string> out;
        for (std::size_t at = 0; (at = text.find("DATE-TIME:", at)) != std::string::npos; ++at)
            out.push_back(text.substr(at + 10, text.find('\n', at) - at - 10));
        return out;
    }

    Hub::Clock::time_point now{};
    Hub hub;
    LiveSegments segments{{.seconds = 1}, hub};
    std::map<std::string, Hub::Publisher> rungs;
};

TEST_F(LiveLadderTest, TheListNamesTheRungsThatAreThereWithTheirRates) {
    for (const auto* name : {"anna~1", "anna~3"}) publish(name, 7);
    send_frames("anna~1", 0, 62, 1000);
    send_frames("anna~3", 0, 62, 4000);
    const auto found = segments.ladder("anna", true, [] {});
    ASSERT_EQ(found.state, State::there);
    EXPECT_NE(found.content.find("FRAME-RATE=30.000"), std::string::npos);
    const auto variants = read_variants(found.content);
    ASSERT_EQ(variants.size(), 2u);
    EXPECT_EQ(variants[0].uri, "../anna~1/stream.m3u8");
    EXPECT_EQ(variants[1].uri, "../anna~3/stream.m3u8");
    EXPECT_EQ(variants[0].codecs, "htvm");
    EXPECT_NEAR(static_cast<double>(variants[0].average), 30 * 8 * 1000, 20000);
    EXPECT_NEAR(static_cast<double>(variants[1].average), 30 * 8 * 4000, 20000);
    EXPECT_GE(variants[1].bits_per_second, variants[1].average);
    EXPECT_EQ(segments.ladder("ann", true, [] {}).state, State::nothing);
    EXPECT_EQ(segments.ladder("anna~1", true, [] {}).state, State::nothing) << "a rung has none";
}

TEST_F(LiveLadderTest, AStreamThatIsNoLadderHasAListOfItself) {
    publish("berta", 7);
    send_frames("berta", 0, 62, 100);
    const auto variants = read_variants(segments.ladder("berta", true, [] {}).content);
    ASSERT_EQ(variants.size(), 1u);
    EXPECT_EQ(variants[0].uri, "stream.m3u8");
}

TEST_F(LiveLadderTest, ARungThatHasBegunIsWaitedForAsLongAsSomebodyIsPatient) {
    for (const auto* name : {"anna~1", "anna~2"}) publish(name, 7);
    send_frames("anna~1", 0, 62, 100);
    int woken = 0;
    const auto waits = segments.ladder("anna", true, [&] { ++woken; });
    EXPECT_EQ(waits.state, State::waits);
    EXPECT_EQ(read_variants(segments.ladder("anna", false, [] {}).content).size(), 1u);
    send_frames("anna~2", 0, 62, 100);
    EXPECT_GT(woken, 0);
    EXPECT_EQ(read_variants(segments.ladder("anna", true, [] {}).content).size(), 2u);
}

TEST_F(LiveLadderTest, RungsAreCutAtTheSameTimesAlthoughOneComesLater) {
    for (const auto* name : {"anna~1", "anna~2"}) publish(name, 7);
    send_frames("anna~1", 0, 182, 100);
    send_frames("anna~2", 75, 182, 100);  // it begins in the middle of the third segment
    const auto first = list("anna~1"), second = list("anna~2");
    ASSERT_EQ(first.segments.size(), 6u);
    ASSERT_EQ(second.segments.size(), 4u);
    EXPECT_EQ(second.first_number, first.first_number + 2);
    EXPECT_NEAR(second.segments[0].seconds, 0.55, 0.06) << "up to where the other one is cut";
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(second.segments[i].seconds, first.segments[2 + i].seconds);
    const auto dates = dates_in(text("anna~1")), later = dates_in(text("anna~2"));
    ASSERT_EQ(later.size(), 4u);
    EXPECT_NE(later[0], dates[2]);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(later[i], dates[2 + i]);
}

TEST_F(LiveLadderTest, RungsOfOtherSessionsHaveNothingInCommon) {
    publish("anna~1", 7);
    publish("anna~2", 8);
    send_frames("anna~1", 0, 62, 100);
    send_frames("anna~2", 15, 92, 100);
    EXPECT_EQ(list("anna~1").segments.size(), 2u);
    EXPECT_EQ(list("anna~2").segments.size(), 3u);
    EXPECT_GE(list("anna~2").first_number, list("anna~1").first_number) << "each begins by the clock";
}

TEST_F(LiveLadderTest, TimestampsAtTheEndsOfTheirRangeAreCut) {
    constexpr auto least = std::numeric_limits<std::int64_t>::min(), most = std::numeric_limits<std::int64_t>::max();
    for (const auto* name : {"anna~1", "anna~2"}) publish(name, 7);
    for (const auto* name : {"anna~1", "anna~2"})
        for (std::uint32_t frame = 0; frame < 4; ++frame) {
            auto packet = live_intra(frame);
            packet.timestamp_us = frame % 2 ? most : least;
            send(name, packet);
        }
    for (const auto* name : {"anna~1", "anna~2"}) hub.leave(rungs[name], true, now);
    EXPECT_NE(text("anna~1"), "");
}

// ---- As viewers and caches see it -----------------------------------------------------------------------------------

class SegmentsServerTest : public ServerTest {
protected:
    SegmentsServerTest() {
        options.hub = &hub;
        options.segments = &segments;
        publisher = *hub.publish(
            "anna", [] {}, Hub::Clock::now());
        for (const auto& packet : {live_header(1), live_intra(0), live_intra(30), live_intra(60), live_intra(90)})
            static_cast<void>(hub.receive_packet(publisher, write_packet(packet), Hub::Clock::now()));
    }
    void TearDown() override { ServerTest::TearDown(); }

    Hub hub;
    LiveSegments segments{{.seconds = 1}, hub};
    Hub::Publisher publisher;
};

TEST_F(SegmentsServerTest, PlaylistsAreKeptForASecondAndSegmentsForEver) {
    options.admission.other_sites = true;
    start();
    const auto answer = get("/hls/anna/stream.m3u8");
    EXPECT_EQ(status(answer), 200);
    EXPECT_EQ(header(answer, "Content-Type"), "application/vnd.apple.mpegurl");
    EXPECT_EQ(header(answer, "Cache-Control"), "public, max-age=1");
    EXPECT_EQ(header(answer, "Access-Control-Allow-Origin"), "*");
    EXPECT_EQ(status(get("/hls/anna/stream.m3u8", "If-None-Match: " + header(answer, "ETag") + "\r\n")), 304);
    EXPECT_EQ(body(get("/hls/anna/stream.m3u8", "", "HEAD")), "");
    const auto list = read_playlist(body(answer)).value();
    ASSERT_EQ(list.segments.size(), 2u);
    const auto path = "/hls/anna/" + list.segments[0].uri;
    const auto whole = get(path);
    EXPECT_EQ(status(whole), 200);
    EXPECT_EQ(header(whole, "Cache-Control"), "public, max-age=31536000, immutable");
    EXPECT_EQ(header(whole, "Content-Type"), "video/mp4");
    const auto part = get(path, "Range: bytes=8-11\r\n");
    EXPECT_EQ(status(part), 206);
    EXPECT_EQ(body(part), body(whole).substr(8, 4));
    EXPECT_EQ(status(get("/hls/anna/" + list.segments[0].map_uri)), 200);
}

TEST_F(SegmentsServerTest, WhatIsNotThereIsAskedForAgainSoon) {
    start();
    for (const char* path : {"/hls/anna/1-none.m4s", "/hls/berta/stream.m3u8"}) {
        EXPECT_EQ(status(get(path)), 404) << path;
        EXPECT_EQ(header(get(path), "Cache-Control"), "public, max-age=1") << path;
    }
    EXPECT_EQ(status(get("/hls/anna")), 404);
    EXPECT_EQ(status(get("/hls/anna/stream.m3u8?_HLS_msn=x")), 400);
    EXPECT_EQ(status(get("/hls/anna/stream.m3u8?_HLS_msn=99999999999")), 400) << "far from what comes next";
}

TEST_F(SegmentsServerTest, ALinkIsAPartOfThePath) {
    options.admission.link_keys = (root / "keys.json").string();
    ASSERT_TRUE(add_link_key(options.admission.link_keys));
    start();
    const auto keys = read_link_keys(options.admission.link_keys).value();
    const auto later = std::chrono::system_clock::now() + std::chrono::hours(1);
    const auto link = "/hls/" + link_segment(link_query(keys, "hls/anna", later));
    EXPECT_EQ(status(get("/hls/anna/stream.m3u8")), 403);
    EXPECT_EQ(status(get(link + "/anna/stream.m3u8")), 200);
    EXPECT_EQ(status(get(link + "/anna/check")), 200);
    EXPECT_EQ(status(get(link + "/berta/check")), 403);
    EXPECT_EQ(status(get("/hls/1-1-00/anna/check")), 403);
    const auto list = read_playlist(body(get(link + "/anna/stream.m3u8"))).value();
    EXPECT_EQ(status(get(link + "/anna/" + list.segments.at(0).uri)), 200);
    const auto named = "/hls/" + link_segment(link_query(keys, "hls/anna", later, "5f0c1e9a"));
    EXPECT_EQ(status(get(named + "/anna/stream.m3u8")), 200);
}

TEST_F(SegmentsServerTest, ALinkToALadderIsOfItsRungs) {
    auto rung = *hub.publish(
        "clara~1", [] {}, Hub::Clock::now());
    for (const auto& packet : {live_header(1), live_intra(0), live_intra(30), live_intra(60)})
        static_cast<void>(hub.receive_packet(rung, write_packet(packet), Hub::Clock::now()));
    options.admission.link_keys = (root / "keys.json").string();
    ASSERT_TRUE(add_link_key(options.admission.link_keys));
    start();
    const auto keys = read_link_keys(options.admission.link_keys).value();
    const auto later = std::chrono::system_clock::now() + std::chrono::hours(1);
    const auto link = "/hls/" + link_segment(link_query(keys, "hls/clara", later));
    const auto answer = get(link + "/clara/master.m3u8");
    EXPECT_EQ(status(answer), 200);
    EXPECT_EQ(header(answer, "Cache-Control"), "public, max-age=1");
    EXPECT_EQ(header(answer, "Content-Type"), "application/vnd.apple.mpegurl");
    EXPECT_EQ(read_variants(body(answer)).at(0).uri, "../clara~1/stream.m3u8");
    EXPECT_EQ(status(get(link + "/clara~1/stream.m3u8")), 200);
    EXPECT_EQ(status(get(link + "/clara~1/check")), 200);
    EXPECT_EQ(status(get(link + "/anna/stream.m3u8")), 403);
    EXPECT_EQ(status(get("/hls/clara/master.m3u8")), 403);
    EXPECT_TRUE(metrics_come_to("htvm_segments_requests_total{answer=\"master_200\"} 1"));
}

TEST_F(SegmentsServerTest, AreAskedForAsWatchingIs) {
    options.authority.url = "http://127.0.0.1:9/may";  // where nobody answers
    start();
    EXPECT_EQ(status(get("/hls/anna/stream.m3u8")), 503);
    EXPECT_EQ(status(get("/hls/anna/check")), 503);
}

TEST_F(SegmentsServerTest, CountsWhatWasAskedFor) {
    start();
    static_cast<void>(get("/hls/anna/stream.m3u8"));
    static_cast<void>(get("/hls/anna/none"));
    EXPECT_TRUE(metrics_come_to("htvm_segments_requests_total{answer=\"playlist_200\"} 1"));
    EXPECT_TRUE(metrics_come_to("htvm_segments_requests_total{answer=\"file_404\"} 1"));
    EXPECT_TRUE(metrics_come_to("htvm_segments_total 2"));
}

}  // namespace
}  // namespace htvm::live
