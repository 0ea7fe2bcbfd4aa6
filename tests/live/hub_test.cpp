// Who may publish a stream, and what of a publisher's messages goes on.
#include "live/hub/hub.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "live_packets.h"

namespace htvm::live {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

constexpr Hub::Clock::time_point start{};

Bytes header(std::uint32_t session) { return write_packet(live_header(session, 50)); }
Bytes intra(std::uint32_t frame) { return write_packet(live_intra(frame, 50)); }
Bytes tracked(std::uint32_t frame) { return write_packet(live_tracked(frame, 50)); }

Bytes real_header(std::uint64_t session) { return write_packet(readable_header(session, 25)); }

struct Fixture : testing::Test {
    Hub hub{HubLimits{.streams = 2, .viewers = 2}};
    int woken = 0;

    Hub::Publisher publisher(const std::string& name = "anna", Hub::Clock::time_point now = start) {
        auto out = hub.publish(
            name, [this] { ++woken; }, now);
        EXPECT_TRUE(out);
        return *out;
    }
    // One that has begun to publish.
    Hub::Publisher publishing(std::uint32_t session_number = 1) {
        const auto out = publisher();
        EXPECT_TRUE(hub.receive_packet(out, header(session_number), start));
        return out;
    }
    Hub::Viewer viewer(const WatchOptions& options = {}, Hub::Clock::time_point now = start) {
        auto out = hub.watch(
            "anna", [this] { ++woken; }, options, now);
        EXPECT_TRUE(out);
        return *out;
    }
    // All that is to be written to a viewer, up to the end of the connection or until nothing is left.
    std::vector<ForViewer> all(const Hub::Viewer& viewer, Hub::Clock::time_point now = start) {
        std::vector<ForViewer> out;
        do out.push_back(hub.next(viewer, now));
        while (!std::holds_alternative<std::monostate>(out.back()) && !std::holds_alternative<Closing>(out.back()));
        return out;
    }
    std::vector<std::uint32_t> frames(const Hub::Viewer& viewer) {
        std::vector<std::uint32_t> out;
        for (const auto& message : all(viewer))
            if (const auto* packet = std::get_if<SharedPacket>(&message))
                if ((*packet)->header.kind != PacketKind::sequence) out.push_back((*packet)->header.frame);
        return out;
    }
    template <class Message>
    std::vector<Message> some(const Hub::Viewer& viewer, Hub::Clock::time_point now = start) {
        std::vector<Message> out;
        for (const auto& message : all(viewer, now))
            if (const auto* one = std::get_if<Message>(&message)) out.push_back(*one);
        return out;
    }
    template <class Message>
    std::vector<Message> some(Hub::Publisher publisher) {
        std::vector<Message> out;
        for (;;) {
            const auto message = hub.next(publisher);
            if (const auto* one = std::get_if<Message>(&message)) out.push_back(*one);
            if (std::holds_alternative<std::monostate>(message) || std::holds_alternative<Closing>(message)) return out;
        }
    }
    // How the connection is closed: "CODE REASON"; "" if it is not.
    template <class Other>
    std::string closing(const Other& other) {
        const auto out = some<Closing>(other);
        if (out.empty()) return "";
        return (out[0].code ? std::to_string(static_cast<int>(*out[0].code)) + ' ' : "dead") + out[0].reason;
    }
    StreamInfo info(Hub::Clock::time_point now = start) { return hub.streams(now).at(0); }
};
using HubTest = Fixture;
using Frames = std::vector<std::uint32_t>;

TEST_F(HubTest, WhatIsPublishedIsWatched) {
    const auto anna = publisher();
    ASSERT_TRUE(hub.receive_packet(anna, header(1), start));
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    const auto late = viewer();
    ASSERT_TRUE(hub.receive_packet(anna, intra(1), start));
    EXPECT_EQ(frames(late), (Frames{0, 1}));
}

TEST_F(HubTest, AStreamBeginsWithASequenceHeader) {
    const auto headless = publisher();
    EXPECT_FALSE(hub.receive_packet(headless, intra(0), start));
    EXPECT_EQ(closing(headless), "1008 the first packet must be a sequence header of version 2 or later");
    const auto garbage = publisher();
    EXPECT_FALSE(hub.receive_packet(garbage, {1, 2, 3}, start));
    EXPECT_EQ(closing(garbage), "1008 the first message is not a packet");
    EXPECT_FALSE(hub.watch(
        "anna", [] {}, {}, start));
    EXPECT_EQ(hub.counters().refused_publishers_message, 2u);
    EXPECT_EQ(hub.counters().refused_viewers_no_stream, 1u);
}

TEST_F(HubTest, DamagedMessagesAreCountedAndGoNoFurther) {
    const auto anna = publishing();
    const auto watching = viewer();
    auto damaged = intra(0);
    damaged[40] ^= 1;
    auto longer = intra(0);
    longer.push_back(0);
    auto shorter = intra(0);
    shorter.pop_back();
    for (const auto& wrong : {damaged, longer, shorter, Bytes{}}) EXPECT_TRUE(hub.receive_packet(anna, wrong, start));
    EXPECT_EQ(frames(watching), Frames{});
    EXPECT_EQ(info().publisher.damaged, 4u);
    EXPECT_EQ(info().publisher.packets, 1u);
    EXPECT_EQ(hub.counters().damaged_messages, 4u);
}

TEST_F(HubTest, TheSameSessionGoesOnOverAnotherConnection) {
    const auto before = publishing();
    ASSERT_TRUE(hub.receive_packet(before, intra(0), start));
    const auto watching = viewer();
    const auto again = publisher();
    ASSERT_TRUE(hub.receive_packet(again, header(1), start + 10ms));
    EXPECT_EQ(closing(before), "4000 this session was continued by another connection");
    EXPECT_FALSE(hub.receive_packet(before, intra(1), start + 10ms));
    ASSERT_TRUE(hub.receive_packet(again, intra(2), start + 20ms));
    hub.leave(before, false, start + 30ms);  // the connection that was replaced ends nothing
    EXPECT_TRUE(info().published);
    EXPECT_EQ(frames(watching), (Frames{0, 2}));
    EXPECT_TRUE(some<Gone>(watching).empty());
}

TEST_F(HubTest, AnotherSessionTakesOverOnlyOnceTheOldOneIsSilent) {
    const auto first = publishing();
    const auto second = publisher();
    ASSERT_FALSE(hub.receive_packet(second, header(2), start + 1999ms));
    EXPECT_EQ(closing(second), "1008 'anna' is being published by another session; end that one, or wait");
    // A heartbeat is heard as well as a packet.
    ASSERT_TRUE(hub.receive_text(first, R"({"type":"heartbeat"})", start + 1s));
    EXPECT_FALSE(hub.receive_packet(publisher(), header(2), start + 2999ms));
    ASSERT_TRUE(hub.receive_packet(publisher(), header(2), start + 3s));
    EXPECT_EQ(closing(first), "4001 another session took the stream over");
    EXPECT_FALSE(hub.receive_packet(first, intra(0), start + 3s));
    EXPECT_EQ(hub.counters().refused_publishers_busy, 2u);
}

TEST_F(HubTest, AfterThePublisherLeftAnotherSessionWaitsAMomentToo) {
    const auto first = publishing();
    hub.leave(first, false, start + 1s);
    EXPECT_FALSE(hub.receive_packet(publisher(), header(2), start + 2s));
    EXPECT_TRUE(hub.receive_packet(publisher(), header(2), start + 3s));
}

TEST_F(HubTest, AStreamWithoutAPublisherEndsAfterAWhile) {
    const auto anna = publishing();
    const auto watching = viewer();
    hub.leave(anna, false, start);
    const auto gone = some<Gone>(watching);
    ASSERT_EQ(gone.size(), 1u);
    EXPECT_EQ(gone[0].reason, "the publisher's connection ended");
    hub.tick(start + 10s);
    EXPECT_EQ(closing(watching), "");
    hub.tick(start + 10001ms);
    EXPECT_TRUE(hub.streams(start).empty());
    EXPECT_EQ(closing(watching), "1000 the stream has ended");
    // Another stream of the same name is none of theirs.
    const auto again = publisher();
    ASSERT_TRUE(hub.receive_packet(again, header(2), start + 11s));
    const auto other = viewer();
    ASSERT_TRUE(hub.receive_packet(again, intra(0), start + 11s));
    EXPECT_EQ(frames(watching), Frames{});
    hub.leave(watching);
    EXPECT_EQ(frames(other), Frames{0});
}

TEST_F(HubTest, AStreamThatItsPublisherEndedEndsWhenItsViewersHaveEverything) {
    const auto anna = publishing();
    const auto watching = viewer(), body = viewer({.texts = false});
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    hub.leave(anna, true, start);
    EXPECT_TRUE(hub.streams(start).empty());
    auto messages = all(watching);
    ASSERT_EQ(messages.size(), 5u);
    EXPECT_TRUE(std::holds_alternative<Hello>(messages[0]));
    EXPECT_EQ(std::get<SharedPacket>(messages[2])->header.kind, PacketKind::intra);
    EXPECT_EQ(std::get<Gone>(messages[3]).reason, "the publisher ended the stream");
    EXPECT_EQ(std::get<Closing>(messages[4]).code, CloseCode::ended);
    messages = all(body);
    ASSERT_EQ(messages.size(), 3u);
    EXPECT_EQ(std::get<SharedPacket>(messages[1])->header.kind, PacketKind::intra);
    EXPECT_EQ(std::get<Closing>(messages[2]).code, CloseCode::ended);
    hub.leave(watching);
    hub.leave(body);
    EXPECT_TRUE(hub.receive_packet(publisher(), header(2), start));  // nobody has to wait
}

TEST_F(HubTest, StreamsAndViewersAreLimited) {
    publishing();
    const auto viewers = {viewer(), viewer()};
    EXPECT_EQ(viewers.size(), 2u);
    EXPECT_FALSE(hub.watch(
        "anna", [] {}, {}, start));
    hub.leave(*viewers.begin());
    viewer();
    const auto ben = publisher("ben");
    ASSERT_TRUE(hub.receive_packet(ben, header(1), start));
    const auto third = hub.publish(
        "dora", [] {}, start);
    ASSERT_FALSE(third);
    EXPECT_EQ(third.error().kind, ErrorKind::limit);
    // Who comes back has its place still.
    hub.leave(ben, false, start);
    const auto late = publisher("ben");
    EXPECT_EQ(hub.counters().refused_viewers_limit, 1u);
    EXPECT_EQ(hub.counters().refused_publishers_limit, 1u);
    EXPECT_TRUE(hub.receive_packet(late, header(1), start));
}

TEST_F(HubTest, MemoryForPacketsIsBounded) {
    // A header and one frame fit, and no other frame; the frame before is kept until another has come.
    const auto size = header(1).size();
    hub = Hub(HubLimits{.streams = 2, .viewers = 2, .memory = 2 * size + size / 2});
    const auto publisher = publishing();
    EXPECT_TRUE(hub.receive_packet(publisher, intra(0), start));
    EXPECT_EQ(hub.counters().memory, 2 * size);
    const auto watching = viewer();
    EXPECT_TRUE(hub.receive_packet(publisher, tracked(1), start));
    EXPECT_EQ(hub.counters().dropped_for_memory, 1u);
    EXPECT_EQ(hub.counters().memory, 2 * size);
    EXPECT_EQ(frames(watching), std::vector<std::uint32_t>{0});
    const auto held = hub.receive_packet(publisher, header(2), start);  // without its header nothing can be shown
    EXPECT_FALSE(held);
    EXPECT_EQ(closing(publisher), "1013 this hub's memory for packets is used up");
}

TEST_F(HubTest, OneStreamHasNoMoreThanItsShareOfTheMemory) {
    const auto size = header(1).size();
    hub = Hub(HubLimits{.stream_memory = 2 * size});
    const auto anna = publishing(), ben = publisher("ben");
    EXPECT_TRUE(hub.receive_packet(anna, intra(0), start));
    EXPECT_TRUE(hub.receive_packet(anna, tracked(1), start));
    EXPECT_EQ(hub.counters().dropped_for_memory, 1u);
    EXPECT_TRUE(hub.receive_packet(ben, header(2), start));
    EXPECT_EQ(hub.counters().dropped_for_memory, 1u);
    EXPECT_FALSE(hub.receive_part(anna, 1, start));
    EXPECT_EQ(closing(anna), "1013 this hub's memory for packets is used up");
    EXPECT_EQ(hub.counters().gave_way, 0u);
}

// A token is for one name: seventy-five connections with 14 MB each once ended the streams of others.
TEST_F(HubTest, OfANameOneConnectionAtATimeMayHaveSentNoPacketYet) {
    std::vector<Hub::Publisher> all;
    for (int i = 0; i < 75; ++i) {
        all.push_back(publisher("eve"));
        EXPECT_TRUE(hub.receive_part(all.back(), 900'000, start));
    }
    for (int i = 0; i < 74; ++i)
        EXPECT_EQ(closing(all[static_cast<std::size_t>(i)]), "1013 a newer connection publishes this stream");
    for (int i = 0; i < 74; ++i) hub.leave(all[static_cast<std::size_t>(i)], false, start);
    EXPECT_EQ(hub.counters().memory, 900'000u);
    EXPECT_TRUE(hub.receive_packet(all.back(), header(1), start));
    EXPECT_EQ(hub.counters().memory, header(1).size());
}

TEST_F(HubTest, AFirstMessageIsNoLargerThanASequenceHeaderMayBe) {
    const auto eve = publisher("eve");
    EXPECT_TRUE(hub.receive_part(eve, std::size_t{1} << 20, start));
    EXPECT_FALSE(hub.receive_part(eve, (std::size_t{1} << 20) + 1, start));
    EXPECT_EQ(closing(eve), "1009 the first message is too large for a sequence header");
}

TEST_F(HubTest, AConnectionWithoutAPacketTakesAStreamsPlace) {
    publisher("ben");
    publisher("carl");
    EXPECT_EQ(hub.publish(
                     "dora", [] {}, start)
                  .error()
                  .kind,
              ErrorKind::limit);
    EXPECT_TRUE(hub.publish(
        "carl", [] {}, start));
}

TEST_F(HubTest, WhereMemoryIsUsedUpTheStreamThatHoldsMostGivesWay) {
    const auto size = header(1).size();
    hub = Hub(HubLimits{.memory = 10 * size});
    const auto anna = publishing(), eve = publisher("eve"), mallory = publisher("mallory");
    const auto watching = viewer();
    ASSERT_TRUE(hub.receive_packet(eve, header(2), start));
    ASSERT_TRUE(hub.receive_packet(mallory, header(3), start));
    ASSERT_TRUE(hub.receive_part(eve, 4 * size, start));
    ASSERT_TRUE(hub.receive_part(mallory, 3 * size, start));
    EXPECT_EQ(hub.counters().memory, 10 * size);
    EXPECT_TRUE(hub.receive_packet(anna, intra(0), start));
    EXPECT_EQ(frames(watching), Frames{0});
    EXPECT_EQ(closing(eve), "1013 this hub's memory for packets is used up");
    EXPECT_EQ(closing(mallory), "");
    EXPECT_EQ(closing(anna), "");
    EXPECT_EQ(hub.counters().gave_way, 1u);
    // Nobody is disturbed for those that hold most.
    EXPECT_TRUE(hub.receive_part(mallory, 5 * size, start));
    EXPECT_FALSE(hub.receive_part(mallory, 9 * size, start));
    EXPECT_EQ(closing(mallory), "1013 this hub's memory for packets is used up");
    EXPECT_EQ(closing(anna), "");
}

TEST_F(HubTest, WhoGivesWayLosesViewersWhoDoNotTakeWhatIsTheirsAndKeepsTheOthers) {
    const auto size = header(1).size();
    hub = Hub(HubLimits{.memory = 8 * size});
    const auto anna = publishing(), ben = publisher("ben");
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    const auto waiting = viewer(), writing = viewer(), keeping_up = viewer();
    for (const auto& each : {waiting, keeping_up}) EXPECT_EQ(frames(each), Frames{0});
    for (std::uint32_t i = 1; i < 6; ++i) {
        ASSERT_TRUE(hub.receive_packet(anna, tracked(i), start));
        EXPECT_EQ(frames(keeping_up), Frames{i});
    }
    // A header and what is sent before it are taken, but not written.
    while (!std::holds_alternative<SharedPacket>(hub.next(writing, start))) {
    }
    EXPECT_EQ(hub.counters().memory, 7 * size);
    ASSERT_TRUE(hub.receive_packet(ben, header(2), start));
    EXPECT_FALSE(hub.ends_at_once(writing));
    EXPECT_TRUE(hub.receive_part(ben, size, start));
    EXPECT_EQ(hub.counters().gave_way, 1u);
    EXPECT_TRUE(hub.ends_at_once(waiting));
    EXPECT_TRUE(hub.ends_at_once(writing));
    EXPECT_FALSE(hub.ends_at_once(keeping_up));
    hub.leave(waiting);
    hub.leave(writing);
    EXPECT_EQ(hub.counters().memory, 2 * size);
    // It takes nothing for a second, and goes on where it can be decoded.
    EXPECT_TRUE(hub.receive_packet(anna, intra(6), start + 999ms));
    EXPECT_TRUE(hub.receive_packet(anna, intra(7), start + 1s));
    EXPECT_EQ(frames(keeping_up), Frames{7});
    EXPECT_EQ(closing(anna), "");
}

TEST_F(HubTest, PacketsThatAreForgottenFreeTheirMemory) {
    const auto publisher = publishing();
    for (std::uint32_t i = 0; i < 10; ++i) EXPECT_TRUE(hub.receive_packet(publisher, intra(i), start));
    EXPECT_EQ(hub.counters().memory, 2 * header(1).size());  // the header and the newest frame
    hub.leave(publisher, true, start);
    EXPECT_EQ(hub.counters().memory, 0u);
}

TEST_F(HubTest, MessagesThatHaveComeInPartTakeMemoryToo) {
    const auto size = header(1).size();
    hub = Hub(HubLimits{.memory = 1000 + size});
    const auto anna = publishing();
    const auto watching = viewer();
    EXPECT_TRUE(hub.receive_part(anna, 300, start));
    EXPECT_TRUE(hub.receive_part(anna, 800, start));
    EXPECT_TRUE(hub.receive_part(watching, 100, start));
    EXPECT_EQ(hub.counters().memory, size + 900);
    EXPECT_TRUE(hub.receive_packet(anna, intra(0), start));  // whole
    EXPECT_EQ(hub.counters().memory, 2 * size + 100);
    EXPECT_TRUE(hub.receive_text(watching, R"({"type":"key_frame"})", start));
    EXPECT_EQ(hub.counters().memory, 2 * size);
    EXPECT_TRUE(hub.receive_part(watching, 100, start));
    hub.leave(watching);
    EXPECT_EQ(hub.counters().memory, 2 * size);
    EXPECT_FALSE(hub.receive_part(anna, 1001, start));
    EXPECT_EQ(closing(anna), "1013 this hub's memory for packets is used up");
    hub.leave(anna, false, start);
    EXPECT_EQ(hub.counters().memory, 2 * size);
    EXPECT_EQ(hub.counters().refused_publishers_limit, 1u);
}

// Each packet takes time by how many are kept.
TEST_F(HubTest, AChainThatGetsTooLongIsTakenUpAgainAtTheNextIntraFrame) {
    hub = Hub(HubLimits{.broadcast = {.kept_packets = 10}});
    const auto anna = publishing();
    const auto watching = viewer();
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    for (std::uint32_t i = 1; i < 20; ++i) ASSERT_TRUE(hub.receive_packet(anna, tracked(i), start));
    // With the header, ten are kept.
    EXPECT_EQ(frames(watching), (Frames{0, 1, 2, 3, 4, 5, 6, 7, 8}));
    EXPECT_EQ(info().undecodable_frames, 11u);
    EXPECT_EQ(some<KeyFrameRequest>(anna).size(), 1u);
    ASSERT_TRUE(hub.receive_packet(anna, intra(20), start));
    ASSERT_TRUE(hub.receive_packet(anna, tracked(21), start));
    EXPECT_EQ(frames(watching), (Frames{20, 21}));
}

TEST_F(HubTest, WhoSendsTooMuchThatCarriesNothingIsClosed) {
    const auto anna = publishing();
    const auto watching = viewer();
    for (int i = 0; i < 50; ++i) EXPECT_TRUE(hub.receive_nothing(watching, start));
    EXPECT_FALSE(hub.receive_nothing(watching, start));
    EXPECT_EQ(closing(watching), "1008 too many messages that carry nothing");
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(hub.receive_nothing(anna, start));
    EXPECT_FALSE(hub.receive_nothing(anna, start));
    EXPECT_EQ(closing(anna), "1008 too many messages that carry nothing");
    EXPECT_EQ(hub.counters().refused_viewers_message, 1u);
    EXPECT_EQ(hub.counters().refused_publishers_message, 1u);
}

TEST_F(HubTest, WhoTakesTooLongForAMessageIsCutOff) {
    hub = Hub(HubLimits{.message_time = 5s});
    const auto slow = publishing(), quick = publisher("ben");
    const auto watching = viewer();
    ASSERT_TRUE(hub.receive_packet(quick, header(2), start));
    for (auto now = start; now < start + 5s; now += 500ms) {
        EXPECT_TRUE(hub.receive_part(slow, 100, now));
        EXPECT_TRUE(hub.receive_part(watching, 100, now));
        EXPECT_TRUE(hub.receive_part(quick, 100, now));
        EXPECT_TRUE(hub.receive_packet(quick, intra(0), now));
        hub.tick(now);
    }
    EXPECT_EQ(closing(slow), "");
    EXPECT_EQ(closing(watching), "");
    hub.tick(start + 5s);
    EXPECT_EQ(closing(slow), "1013 a message has not come whole within 5 seconds");
    EXPECT_EQ(closing(watching), "1013 a message has not come whole within 5 seconds");
    EXPECT_EQ(closing(quick), "");
    EXPECT_FALSE(hub.stream("anna", start + 5s)->published);
    EXPECT_EQ(hub.counters().slow_publishers, 1u);
    EXPECT_EQ(hub.counters().slow_viewers, 1u);
    hub.leave(slow, false, start + 5s);
    hub.leave(watching);
    hub.leave(quick, false, start + 5s);
    EXPECT_EQ(hub.counters().closed, (std::map<std::string, std::uint64_t>{
                                         {"publisher_left", 1}, {"publisher_try_later", 1}, {"viewer_try_later", 1}}));
}

TEST_F(HubTest, TheLogSaysWhoPublishedLeftAndWasRefused) {
    std::vector<std::string> names;
    hub = Hub({}, [&](const Event& event) { names.push_back(event.stream + ' ' + event.name); });
    const auto first = publishing(1), second = publisher();
    EXPECT_FALSE(hub.receive_packet(second, header(2), start));
    hub.leave(first, true, start);
    EXPECT_EQ(names, (std::vector<std::string>{"anna published", "anna refused", "anna left", "anna ended"}));
}

// ---- Text messages: docs/live.md, section 2
// ---------------------------------------------------------------------------

TEST_F(HubTest, HelloComesFirst) {
    hub.name_other_hubs({"wss://b.example"});
    const auto anna = publisher();
    auto hello = std::get<Hello>(hub.next(anna));
    EXPECT_EQ(hello.version, 1u);
    EXPECT_EQ(hello.stream, "anna");
    EXPECT_EQ(hello.session, std::nullopt);
    EXPECT_EQ(hello.hubs, std::vector<std::string>{"wss://b.example"});
    EXPECT_TRUE(std::holds_alternative<std::monostate>(hub.next(anna)));
    ASSERT_TRUE(hub.receive_packet(anna, real_header(0x1234), start));
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    hello = std::get<Hello>(hub.next(viewer(), start));
    EXPECT_EQ(hello.stream, "anna");
    EXPECT_EQ(hello.session, 0x1234u);
    EXPECT_EQ(std::get<Hello>(hub.next(publisher())).session, 0x1234u);
    EXPECT_EQ(info().header->session, 0x1234u);
    EXPECT_EQ(info().header->fps_numerator, 25u);
    EXPECT_TRUE(some<Hello>(viewer({.texts = false})).empty());
}

TEST_F(HubTest, ViewersAreToldOfTheOtherHubsInTurn) {
    hub.name_other_hubs({"wss://b.example", "wss://c.example", "wss://d.example"});
    publishing();
    std::vector<std::string> firsts;
    for (int i = 0; i < 6; ++i) {
        const auto watching = viewer();
        const auto hubs = std::get<Hello>(hub.next(watching, start)).hubs;
        hub.leave(watching);
        EXPECT_THAT(hubs, testing::UnorderedElementsAre("wss://b.example", "wss://c.example", "wss://d.example"));
        firsts.push_back(hubs.front());
    }
    for (const auto* address : {"wss://b.example", "wss://c.example", "wss://d.example"})
        EXPECT_EQ(std::count(firsts.begin(), firsts.end(), address), 2) << address;
}

TEST_F(HubTest, HeartbeatsGoBothWaysEachSecond) {
    const auto anna = publisher();
    ASSERT_TRUE(hub.receive_packet(anna, real_header(7), start));
    const auto watching = viewer();
    some<Hello>(anna), some<Hello>(watching);
    std::size_t to_publisher = 0, to_viewer = 0;
    for (auto now = start; now < start + 10s; now += 100ms) {
        hub.heard(anna, now);
        hub.tick(now);
        to_publisher += some<HeartbeatToPublisher>(anna).size();
        to_viewer += some<HeartbeatToViewer>(watching, now).size();
    }
    EXPECT_EQ(to_publisher, 9u);
    EXPECT_EQ(to_viewer, 10u);
    hub.tick(start + 10s);
    const auto told = std::get<HeartbeatToPublisher>(hub.next(anna));
    EXPECT_EQ(told.viewers, 1u);
    EXPECT_EQ(told.packets, 1u);
    EXPECT_EQ(told.bytes, real_header(7).size());
    EXPECT_EQ(told.damaged, 0u);
    hub.tick(start + 11s);
    auto seen = some<HeartbeatToViewer>(watching, start + 11s).at(0);
    EXPECT_TRUE(seen.published);
    EXPECT_EQ(seen.clock, std::nullopt);
    EXPECT_EQ(seen.session, 7u);
    EXPECT_EQ(seen.viewers, 1u);
    EXPECT_EQ(seen.dropped, 0u);
    hub.leave(anna, false, start + 11s);
    hub.tick(start + 12s);
    EXPECT_FALSE(some<HeartbeatToViewer>(watching, start + 12s).at(0).published);
}

TEST_F(HubTest, ManyViewersWhoCameAtOnceAreNotAllToldAtOnce) {
    Hub large;
    const auto anna = large.publish(
        "anna", [] {}, start);
    ASSERT_TRUE(large.receive_packet(*anna, header(1), start));
    std::vector<Hub::Viewer> viewers;
    for (int i = 0; i < 100; ++i)
        viewers.push_back(*large.watch(
            "anna", [] {}, {}, start));
    for (auto now = start + 100ms; now <= start + 1s; now += 100ms) {
        large.tick(now);
        int told = 0;
        for (const auto& one : viewers)
            for (auto message = large.next(one, now); !std::holds_alternative<std::monostate>(message);
                 message = large.next(one, now))
                told += std::holds_alternative<HeartbeatToViewer>(message) ? 1 : 0;
        EXPECT_EQ(told, 10);
    }
}

TEST_F(HubTest, ThePublishersClockGoesOnByTheHubsOwn) {
    const auto anna = publishing();
    const auto watching = viewer();
    const auto clock = [&](Hub::Clock::time_point now) {
        hub.heard(anna, now);
        hub.tick(now);
        const auto heartbeats = some<HeartbeatToViewer>(watching, now);
        return heartbeats.empty() ? std::nullopt : heartbeats[0].clock;
    };
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"heartbeat","clock":5000000})", start + 1s));
    EXPECT_EQ(clock(start + 1500ms), 5500000);
    // This one was late on its way, the one after it was not.
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"heartbeat","clock":6000000})", start + 2030ms));
    EXPECT_EQ(clock(start + 2500ms), 6500000);
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"heartbeat","clock":7010000})", start + 3s));
    EXPECT_EQ(clock(start + 3500ms), 7510000);
    // Set back.
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"heartbeat","clock":1000000})", start + 4s));
    EXPECT_EQ(clock(start + 4500ms), 1500000);
    EXPECT_EQ(info(start + 5s).clock, 2000000);
    // Another session's is another.
    ASSERT_TRUE(hub.receive_packet(anna, header(2), start + 5s));
    EXPECT_EQ(clock(start + 5500ms), std::nullopt);
}

TEST_F(HubTest, WhoTakesLeaveMakesPlaceForAnotherSessionAtOnceAndWhoIsLostDoesNot) {
    const auto first = publisher();
    ASSERT_TRUE(hub.receive_packet(first, header(1), start));
    hub.lets_go(first);
    hub.leave(first, false, start);
    const auto second = publisher();
    EXPECT_TRUE(hub.receive_packet(second, header(2), start));
    hub.leave(second, false, start);
    const auto third = publisher();
    EXPECT_FALSE(hub.receive_packet(third, header(3), start));
}

TEST_F(HubTest, ASilentPublishersConnectionEndsButNotOneThatHasNoFrames) {
    hub = Hub();
    const auto silent = publishing(), without_frames = publisher("ben"), nothing = publisher("carl");
    const auto watching = viewer();
    ASSERT_TRUE(hub.receive_packet(without_frames, header(2), start));
    for (auto now = start; now <= start + 2900ms; now += 100ms) hub.tick(now);
    ASSERT_TRUE(hub.receive_text(without_frames, R"({"type":"heartbeat"})", start + 2900ms));
    EXPECT_EQ(closing(silent), "");
    hub.tick(start + 3s);
    EXPECT_EQ(closing(silent), "1013 nothing was heard of the publisher");
    EXPECT_EQ(closing(nothing), "1013 nothing was heard of the publisher");
    EXPECT_EQ(closing(without_frames), "");
    EXPECT_FALSE(info().published);
    EXPECT_EQ(some<Gone>(watching).at(0).reason, "the publisher has fallen silent");
    EXPECT_EQ(hub.counters().silent_publishers, 2u);
    // A large packet on its way is no silence.
    hub.heard(without_frames, start + 5s);
    hub.tick(start + 7s);
    EXPECT_EQ(closing(without_frames), "");
    // It comes back and goes on.
    hub.leave(silent, false, start + 4s);
    const auto again = publisher("anna", start + 5s);
    ASSERT_TRUE(hub.receive_packet(again, header(1), start + 5s));
    EXPECT_TRUE(info().published);
}

TEST_F(HubTest, AKeyFrameIsAskedForAtMostOnceASecond) {
    const auto anna = publishing();
    const auto watching = viewer();
    const auto asked = [&] { return some<KeyFrameRequest>(anna).size(); };
    const auto ask = [&](auto now) { EXPECT_TRUE(hub.receive_text(watching, R"({"type":"key_frame"})", now)); };
    EXPECT_EQ(asked(), 0u);
    woken = 0;
    ask(start);
    EXPECT_EQ(woken, 1);
    EXPECT_EQ(asked(), 1u);
    ask(start + 500ms);
    hub.tick(start + 900ms);
    EXPECT_EQ(asked(), 0u);
    hub.tick(start + 1s);  // it was not forgotten
    EXPECT_EQ(asked(), 1u);
    // What comes meanwhile is what was asked for.
    ask(start + 1500ms);
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start + 1600ms));
    hub.tick(start + 2s);
    EXPECT_EQ(asked(), 0u);
    EXPECT_EQ(info().key_frame_requests, 2u);
}

TEST_F(HubTest, WhereNoFrameCanBeDecodedAKeyFrameIsAskedFor) {
    const auto anna = publishing();
    for (std::uint32_t frame : {0u, 1u, 2u})
        ASSERT_TRUE(hub.receive_packet(anna, frame == 0 ? intra(0) : tracked(frame), start));
    const auto watching = viewer();
    hub.leave(anna, false, start);
    // It comes back and knows nothing of a gap: what the hub keeps is enough to go on.
    const auto again = publisher();
    ASSERT_TRUE(hub.receive_packet(again, header(1), start));
    ASSERT_TRUE(hub.receive_packet(again, tracked(3), start));
    EXPECT_TRUE(some<KeyFrameRequest>(again).empty());
    // Frame 4 was lost.
    ASSERT_TRUE(hub.receive_packet(again, tracked(5), start));
    EXPECT_EQ(some<KeyFrameRequest>(again).size(), 1u);
    ASSERT_TRUE(hub.receive_packet(again, tracked(6), start + 100ms));
    EXPECT_EQ(some<KeyFrameRequest>(again).size(), 0u);
    ASSERT_TRUE(hub.receive_packet(again, intra(7), start + 200ms));
    ASSERT_TRUE(hub.receive_packet(again, tracked(8), start + 300ms));
    EXPECT_EQ(frames(watching), (Frames{0, 1, 2, 3, 7, 8}));
    EXPECT_EQ(hub.counters().undecodable_frames, 2u);
}

TEST_F(HubTest, APublisherWhoComesBackMaySendAgainWhatWasKept) {
    const auto before = publishing();
    for (std::uint32_t frame : {0u, 1u})
        ASSERT_TRUE(hub.receive_packet(before, frame == 0 ? intra(0) : tracked(frame), start));
    const auto watching = viewer();
    const auto again = publisher();
    ASSERT_TRUE(hub.receive_packet(again, header(1), start));
    for (std::uint32_t frame : {0u, 1u, 2u, 3u})  // 2 was lost with the first connection
        ASSERT_TRUE(hub.receive_packet(again, frame == 0 ? intra(0) : tracked(frame), start));
    EXPECT_EQ(frames(watching), (Frames{0, 1, 2, 3}));
    EXPECT_TRUE(some<KeyFrameRequest>(again).empty());
}

TEST_F(HubTest, AListenerIsToldWhatWentToTheViewers) {
    Frames sent;
    std::vector<std::string> ended;
    hub.listen({.sent = [&](const std::string& stream, const SharedPacket& packet,
                            auto) { sent.push_back(stream == "anna" ? packet->header.frame : 999); },
                .ended = [&](const std::string& stream) { ended.push_back(stream); }});
    const auto anna = publishing();
    for (const auto& one : {intra(0), intra(0), tracked(1), tracked(3), tracked(4), intra(5)})
        ASSERT_TRUE(hub.receive_packet(anna, one, start));
    EXPECT_EQ(sent, (Frames{0, 0, 1, 5}));  // the header's, which is 0, and those that can be decoded, once
    EXPECT_TRUE(ended.empty());
    hub.leave(anna, true, start);
    EXPECT_EQ(ended, std::vector<std::string>{"anna"});
}

TEST_F(HubTest, StampsGoToThoseWhoAskedRightBeforeTheirPackets) {
    const auto anna = publishing();
    const auto with = viewer({.stamps = true}), without = viewer();
    frames(with), frames(without);
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"stamp","frame":0,"sent":123})", start));
    ASSERT_TRUE(hub.receive_packet(anna, intra(0), start));
    ASSERT_TRUE(hub.receive_packet(anna, tracked(1), start));
    ASSERT_TRUE(hub.receive_text(anna, R"({"type":"stamp","frame":9,"sent":124})", start));  // not of the next frame
    ASSERT_TRUE(hub.receive_packet(anna, tracked(2), start));
    const auto messages = all(with);
    ASSERT_EQ(messages.size(), 6u);
    const auto stamp = std::get<Stamp>(messages[1]);
    EXPECT_EQ(stamp.frame, 0u);
    EXPECT_EQ(stamp.sent, 123);
    EXPECT_GT(*stamp.hub, 1700000000000000);
    EXPECT_EQ(std::get<SharedPacket>(messages[2])->header.kind, PacketKind::intra);
    EXPECT_EQ(std::get<SharedPacket>(messages[3])->header.frame, 1u);
    EXPECT_TRUE(some<Stamp>(without).empty());
    EXPECT_EQ(hub.counters().packets_out, 8u);
}

TEST_F(HubTest, TextsComeBeforePacketsThatWait) {
    const auto anna = publishing();
    const auto watching = viewer();
    for (std::uint32_t frame : {0u, 1u, 2u})
        ASSERT_TRUE(hub.receive_packet(anna, frame == 0 ? intra(0) : tracked(frame), start));
    hub.tick(start + 1s);
    const auto messages = all(watching);
    EXPECT_TRUE(std::holds_alternative<Hello>(messages[0]));
    EXPECT_TRUE(std::holds_alternative<HeartbeatToViewer>(messages[1]));
    EXPECT_TRUE(std::holds_alternative<SharedPacket>(messages[2]));
}

TEST_F(HubTest, WhoFloodsTextOrSendsWhatIsNoMessageIsClosed) {
    const auto anna = publishing();
    const auto flooding = viewer(), calm = viewer();
    for (int i = 0; i < 50; ++i) ASSERT_TRUE(hub.receive_text(flooding, R"({"type":"x"})", start));
    EXPECT_FALSE(hub.receive_text(flooding, R"({"type":"x"})", start));
    EXPECT_EQ(closing(flooding), "1008 too many text messages");
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(hub.receive_text(calm, R"({"type":"x"})", start + i * 100ms));
    EXPECT_FALSE(hub.receive_text(calm, "hello", start));
    EXPECT_EQ(closing(calm), "1008 the text message is not a JSON object");
    EXPECT_FALSE(hub.receive_text(anna, std::string(5000, ' '), start));
    EXPECT_EQ(closing(anna), "1009 the text message is longer than 4096 bytes");
    EXPECT_FALSE(info().published);
    EXPECT_EQ(hub.counters().refused_viewers_message, 2u);
    EXPECT_EQ(hub.counters().refused_publishers_message, 1u);
}

TEST_F(HubTest, AHubThatShutsDownTellsEverybody) {
    const auto anna = publishing();
    const auto watching = viewer();
    hub.close_all(CloseCode::shut_down, "the hub shuts down");
    EXPECT_EQ(closing(anna), "1001 the hub shuts down");
    EXPECT_EQ(closing(watching), "1001 the hub shuts down");
}

}  // namespace
}  // namespace htvm::live
