// Publishing and watching over real connections, on this machine's loopback address.
#include "live/server/live_connection.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <thread>

#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"
#include "live/server/recorder.h"
#include "live_packets.h"
#include "server_test.h"
#include "web_socket.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;

class LiveConnectionTest : public ServerTest {
protected:
    // Publishers may pause, unless a test is of that.
    LiveConnectionTest()
        : LiveConnectionTest(HubLimits{.streams = 2, .publisher_silence = std::chrono::seconds(600)}) {}
    explicit LiveConnectionTest(const HubLimits& limits) : hub(limits) {
        options.admission.connections_per_address = options.admission.viewers_per_address = 300;
        options.hub = &hub;
    }
    void SetUp() override { start(); }

    WebSocket open(const std::string& target) {
        auto out = WebSocket::open(connect(), host, target);
        EXPECT_EQ(out.status, 101u);
        return out;
    }

    // Waits until the server has told that many packets, since messages arrive when they arrive.
    void wait_for_packets(std::uint64_t count) {
        const auto told = "\"packets\":" + std::to_string(count) + ",";
        EXPECT_TRUE(soon([&] { return get("/api/streams").find(told) != std::string::npos; })) << get("/api/streams");
    }

    Hub hub;
};

TEST_F(LiveConnectionTest, WhatIsPublishedIsWatchedByEverybodyLateOnesToo) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    publisher.send(live_tracked(1));
    wait_for_packets(3);
    auto late = open("/watch/anna");
    EXPECT_EQ(late.next()->kind, PacketKind::sequence);
    EXPECT_EQ(late.next_frame(), 0u);
    EXPECT_EQ(late.next_frame(), 1u);
    publisher.send(live_tracked(2));
    EXPECT_EQ(late.next_frame(), 2u);
    EXPECT_NE(get("/api/streams").find(R"("name":"anna","packets":4,"published":true)"), std::string::npos);
}

TEST_F(LiveConnectionTest, TheEndlessBodyHasTheSamePackets) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto socket = connect();
    net::write(socket, net::buffer(std::string("GET /watch/anna HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")));
    publisher.send(live_tracked(1));
    const auto chunk = [](const Packet& packet) {
        const auto bytes = write_packet(packet);
        std::array<char, 16> size{};
        std::snprintf(size.data(), size.size(), "%zx\r\n", bytes.size());
        return size.data() + std::string(bytes.begin(), bytes.end()) + "\r\n";
    };
    const auto expected = chunk(live_header(1)) + chunk(live_intra(0)) + chunk(live_tracked(1));
    std::string got;
    while (got.find("\r\n\r\n") == std::string::npos || got.size() < got.find("\r\n\r\n") + 4 + expected.size()) {
        std::array<char, 4096> piece{};
        got.append(piece.data(), socket.read_some(net::buffer(piece)));
    }
    EXPECT_EQ(got.substr(0, 15), "HTTP/1.1 200 OK");
    EXPECT_EQ(got.substr(got.find("\r\n\r\n") + 4), expected);
}

TEST_F(LiveConnectionTest, WhatCannotBeIsRefusedWithAReason) {
    EXPECT_EQ(open("/watch/nobody").closing(), "1013 there is no stream 'nobody'");
    EXPECT_EQ(get("/watch/nobody").substr(0, 22), "HTTP/1.1 404 Not Found");
    auto first = open("/publish/anna");
    first.send(live_header(1));
    wait_for_packets(1);
    auto second = open("/publish/anna");
    second.send(live_header(2));
    EXPECT_EQ(second.closing(), "1008 'anna' is being published by another session; end that one, or wait");
    auto headless = open("/publish/ben");
    headless.send(live_intra(0));
    EXPECT_EQ(headless.closing(), "1008 the first packet must be a sequence header of version 2 or later");
    auto again = open("/publish/anna");
    again.send(live_header(1));
    EXPECT_EQ(first.closing(), "4000 this session was continued by another connection");
    again.send(live_intra(0));
    wait_for_packets(3);
}

TEST_F(LiveConnectionTest, WithoutKnownPublishersOnlyProgramsOnThisMachineMayPublish) {
    const auto status = [this](const std::string& headers) {
        websocket::stream<tcp::socket> stream(connect());
        stream.set_option(websocket::stream_base::decorator([&headers](websocket::request_type& request) {
            const auto colon = headers.find(':');
            if (!headers.empty()) request.set(headers.substr(0, colon), headers.substr(colon + 2));
        }));
        websocket::response_type response;
        beast::error_code error;
        stream.handshake(response, "127.0.0.1:" + std::to_string(server->port()), "/publish/anna", error);
        return response.result_int();
    };
    EXPECT_EQ(status(""), 101u);
    EXPECT_EQ(status("Origin: http://127.0.0.1:" + std::to_string(server->port())), 101u);
    EXPECT_EQ(status("Origin: https://a.example"), 403u);
    EXPECT_EQ(status("Origin: null"), 403u);
    EXPECT_EQ(status("X-Forwarded-For: 192.0.2.1"), 403u);
}

TEST_F(LiveConnectionTest, AViewerWhoDoesNotReadDelaysNobodyAndGoesOnAtTheNewestIntraFrame) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto paused = open("/watch/anna"), quick = open("/watch/anna");
    EXPECT_EQ(quick.next()->kind, PacketKind::sequence);
    constexpr std::uint32_t frames = 300;
    for (std::uint32_t i = 0; i < frames; ++i) {
        if (i > 0) publisher.send(i % 30 == 0 ? live_intra(i, 60000) : live_tracked(i, 30000));
        ASSERT_EQ(quick.next_frame(), i);
    }
    // It gets what the buffers on the way held of nine megabytes, and then the newest I-frame with what followed.
    std::vector<PacketHeader> headers;
    while (headers.empty() || headers.back().frame + 1 < frames) {
        const auto next = paused.next();
        ASSERT_TRUE(next);
        headers.push_back(*next);
    }
    EXPECT_LT(headers.size(), 270u);
    for (std::size_t i = 1; i < headers.size(); ++i)
        if (frame_type(headers[i].kind)) {
            ASSERT_FALSE(closure(headers, i).empty()) << i;
        }
    const auto said = get("/api/streams");
    EXPECT_EQ(said.find("\"dropped_frames\":0,"), std::string::npos) << said;
}

TEST_F(LiveConnectionTest, TwoHundredViewersGetExactlyWhatWasPublished) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    wait_for_packets(1);
    std::vector<WebSocket> viewers;
    for (int i = 0; i < 200; ++i) viewers.push_back(open("/watch/anna"));
    std::vector<std::vector<std::uint8_t>> published = {write_packet(live_header(1))};
    for (std::uint32_t i = 0; i < 40; ++i) {
        const auto frame = i % 20 == 0 ? live_intra(i, 20000) : live_tracked(i, 2000);
        publisher.send(frame);
        published.push_back(write_packet(frame));
    }
    for (auto& viewer : viewers)
        for (const auto& packet : published) {
            const auto got = viewer.next_bytes();
            ASSERT_TRUE(got);
            ASSERT_EQ(*got, std::string(packet.begin(), packet.end()));
        }
    EXPECT_NE(get("/api/streams").find("\"dropped_frames\":0,"), std::string::npos);
}

// ---- Text messages --------------------------------------------------------------------------------------------------

TEST_F(LiveConnectionTest, TheHubSaysHelloAndItsHeartBeats) {
    auto publisher = open("/publish/anna");
    EXPECT_EQ(*publisher.read(), R"({"hubs":[],"stream":"anna","type":"hello","version":1})");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    publisher.say(R"({"type":"heartbeat","clock":1000000})");
    wait_for_packets(2);
    auto viewer = open("/watch/anna");
    EXPECT_EQ(*viewer.read(), R"({"hubs":[],"stream":"anna","type":"hello","version":1})");
    const auto to_viewer = viewer.next_text("heartbeat");
    EXPECT_NE(to_viewer.find(R"("published":true,"type":"heartbeat","viewers":1)"), std::string::npos) << to_viewer;
    EXPECT_NE(to_viewer.find(R"("clock":)"), std::string::npos) << to_viewer;
    std::string to_publisher;
    do to_publisher = publisher.next_text("heartbeat");
    while (to_publisher.find(R"("viewers":0)") != std::string::npos);  // those from before the viewer came
    EXPECT_NE(to_publisher.find(R"("damaged":0,"packets":2,"type":"heartbeat","viewers":1)"), std::string::npos)
        << to_publisher;
}

TEST_F(LiveConnectionTest, AViewersRequestForAKeyFrameReachesThePublisher) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto viewer = open("/watch/anna");
    viewer.say(R"({"type":"key_frame"})");
    EXPECT_EQ(publisher.next_text("key_frame"), R"({"type":"key_frame"})");
}

TEST_F(LiveConnectionTest, StampsComeToThoseWhoAskForThem) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto with = open("/watch/anna?stamps"), without = open("/watch/anna");
    EXPECT_EQ(with.next()->kind, PacketKind::sequence);
    EXPECT_EQ(with.next_frame(), 0u);
    publisher.say(R"({"type":"stamp","frame":1,"sent":5})");
    publisher.send(live_tracked(1));
    const auto stamp = with.next_text("stamp");
    EXPECT_EQ(stamp.substr(0, 17), R"({"frame":1,"hub":)");
    EXPECT_EQ(stamp.substr(stamp.size() - 25), R"(,"sent":5,"type":"stamp"})");
    EXPECT_EQ(with.next_frame(), 1u);
    for (std::string seen; seen.find("HTVP") == std::string::npos || seen[8] != 1; seen = *without.read())
        EXPECT_EQ(seen.find("stamp"), std::string::npos);
}

TEST_F(LiveConnectionTest, ViewersAreToldThatAPublisherIsGoneAndWhenTheStreamEnds) {
    auto publisher = std::make_optional(open("/publish/anna"));
    publisher->send(live_header(1));
    publisher->send(live_intra(0));
    wait_for_packets(2);
    auto viewer = open("/watch/anna");
    publisher.reset();  // the line breaks
    EXPECT_EQ(viewer.next_text("gone"), R"({"reason":"the publisher's connection ended","type":"gone"})");
    std::string heartbeat;
    do heartbeat = viewer.next_text("heartbeat");
    while (heartbeat.find(R"("published":true)") != std::string::npos);
    EXPECT_NE(heartbeat.find(R"("published":false)"), std::string::npos) << heartbeat;
    publisher.emplace(open("/publish/anna"));
    publisher->send(live_header(1));
    publisher->send(live_tracked(1));
    wait_for_packets(4);
    publisher->say(R"({"type":"end"})");
    publisher->stream.close(websocket::close_code::normal);
    EXPECT_EQ(viewer.closing(), "1000 the publisher ended the stream");
}

// As when the encoder is restarted.
TEST_F(LiveConnectionTest, APublisherWhoLeavesInOrderAndComesBackKeepsItsViewers) {
    auto before = open("/publish/anna");
    before.send(live_header(1));
    before.send(live_intra(0));
    wait_for_packets(2);
    auto viewer = open("/watch/anna");
    EXPECT_EQ(viewer.next()->kind, PacketKind::sequence);
    EXPECT_EQ(viewer.next_frame(), 0u);
    before.stream.close(websocket::close_code::normal);
    EXPECT_EQ(viewer.next_text("gone"), R"({"reason":"the publisher's connection ended","type":"gone"})");
    auto again = open("/publish/anna");
    again.send(live_header(1));
    again.send(live_intra(1));
    EXPECT_EQ(viewer.next()->kind, PacketKind::sequence);
    EXPECT_EQ(viewer.next_frame(), 1u);
}

TEST_F(LiveConnectionTest, MessagesThatAreTooLargeOrNoneEndTheirConnectionAndNoOther) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto calm = open("/watch/anna"), large = open("/watch/anna"), rude = open("/watch/anna"),
         flood = open("/watch/anna");
    large.say(std::string(5000, ' '));
    EXPECT_EQ(large.closing().substr(0, 4), "1009");
    rude.say("hello?");
    EXPECT_EQ(rude.closing(), "1008 the text message is not a JSON object");
    beast::error_code ignored;
    flood.stream.binary(true);
    for (int i = 0; i < 100; ++i) flood.stream.write(net::buffer("x", 1), ignored);
    EXPECT_EQ(flood.closing(), "1008 too many text messages");
    auto other = open("/publish/ben");
    other.send(live_header(2));
    other.say(std::string(5000, ' '));
    EXPECT_EQ(other.closing(), "1009 the text message is longer than 4096 bytes");
    // Messages that are no packets, and a packet that no decoder accepts: counted and dropped, or passed on.
    publisher.stream.binary(true);
    for (const std::size_t size : {1, 35, 36, 5000}) publisher.stream.write(net::buffer(std::string(size, 'H')));
    publisher.send(live_tracked(1));
    EXPECT_EQ(calm.next()->kind, PacketKind::sequence);
    EXPECT_EQ(calm.next_frame(), 0u);
    EXPECT_EQ(calm.next_frame(), 1u);
    EXPECT_NE(get("/api/streams").find("\"damaged_messages\":4,"), std::string::npos);
}

TEST_F(LiveConnectionTest, AFloodOfPingsEndsItsConnectionAndIsCounted) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    wait_for_packets(1);
    auto flood = open("/watch/anna");
    beast::error_code ignored;
    for (int i = 0; i < 100; ++i) flood.stream.ping({}, ignored);
    EXPECT_EQ(flood.closing(), "1008 too many messages that carry nothing");
    EXPECT_TRUE(metrics_come_to("htvm_refused_total{cause=\"viewer_message\"} 1")) << get("/metrics");
}

TEST_F(LiveConnectionTest, APublisherWhoseMessageIsTooLargeIsToldSo) {
    auto publisher = open("/publish/anna");
    beast::error_code ignored;
    publisher.stream.binary(true);
    publisher.stream.write(net::buffer(std::vector<char>((std::size_t{16} << 20) + 1000)), ignored);
    EXPECT_EQ(publisher.closing().substr(0, 4), "1009");
}

class RecordedLiveConnectionTest : public LiveConnectionTest {
protected:
    RecordedLiveConnectionTest() {
        std::filesystem::create_directory(folder);
        recorder.emplace(std::move(*Recorder::open({.folder = folder})));
        options.recorder = &*recorder;
    }
    std::filesystem::path folder = root / "recorded";
    std::optional<Recorder> recorder;
};

TEST_F(RecordedLiveConnectionTest, WhatGoesToTheViewersIsRecorded) {
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_tracked(4));  // nobody can decode it: a key frame is asked for
    EXPECT_EQ(publisher.next_text("key_frame"), R"({"type":"key_frame"})");
    publisher.send(live_intra(5));
    publisher.send(live_tracked(6));
    publisher.send(live_tracked(6));  // again
    wait_for_packets(5);
    const auto metrics = get("/metrics");
    EXPECT_NE(metrics.find("htvm_recording_faults_total 0\n"), std::string::npos) << metrics;
    publisher.say(R"({"type":"end"})");
    publisher.stream.close(websocket::close_code::normal);
    EXPECT_TRUE(soon([&] { return get("/api/streams").find("anna") == std::string::npos; }));
    stop();
    recorder->finish();
    EXPECT_EQ(recorder->counters().packets, 3u);
    std::vector<std::filesystem::path> files(std::filesystem::directory_iterator(folder), {});
    ASSERT_EQ(files.size(), 1u);
    std::ifstream in(files[0], std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    std::string expected;
    for (const auto& packet : {live_header(1), live_intra(5), live_tracked(6)}) {
        const auto written = write_packet(packet);
        expected.append(written.begin(), written.end());
    }
    EXPECT_TRUE(bytes.ends_with(expected));
    EXPECT_GT(bytes.size(), expected.size());  // the index
}

class HastyLiveConnectionTest : public LiveConnectionTest {
protected:
    HastyLiveConnectionTest()
        : LiveConnectionTest(HubLimits{.message_time = std::chrono::milliseconds(500),
                                       .silence = std::chrono::milliseconds(200),
                                       .publisher_silence = std::chrono::seconds(600)}) {}
};

TEST_F(HastyLiveConnectionTest, APublisherWhoseStreamWentToANewerSessionIsToldSo) {
    auto first = open("/publish/anna");
    first.send(live_header(1));
    wait_for_packets(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    auto second = open("/publish/anna");
    second.send(live_header(2));
    EXPECT_EQ(first.closing(), "4001 another session took the stream over");
    second.send(live_intra(7));
    wait_for_packets(3);
    auto viewer = open("/watch/anna");
    EXPECT_EQ(viewer.next()->reference, 2u);
    EXPECT_EQ(viewer.next_frame(), 7u);
}

TEST_F(HastyLiveConnectionTest, AMessageThatComesAByteAtATimeIsCutOffAfterItsTimeCountedAndHoldsUpNobody) {
    auto slow = open("/publish/anna"), publisher = open("/publish/ben");
    slow.send(live_header(1));
    publisher.send(live_header(2));
    publisher.send(live_intra(0));
    wait_for_packets(2);
    auto slow_viewer = open("/watch/ben"), viewer = open("/watch/ben");
    EXPECT_EQ(viewer.next()->kind, PacketKind::sequence);
    EXPECT_EQ(viewer.next_frame(), 0u);
    // The beginning of a frame: of 4,096 bytes, masked by 0.
    const auto trickle = [begin = std::chrono::steady_clock::now()](WebSocket& from, const std::string& more) {
        beast::error_code error;
        net::write(from.stream.next_layer(), net::buffer(more), error);
        const auto passed = std::chrono::steady_clock::now() - begin;
        if (error) {
            EXPECT_GE(passed, std::chrono::milliseconds(490));
        }
        return !error && passed < std::chrono::seconds(10);
    };
    trickle(slow, std::string("\x82\xfe\x10\0\0\0\0\0", 8));
    trickle(slow_viewer, std::string("\x81\xfe\x10\0\0\0\0\0", 8));
    std::uint32_t frame = 0;
    for (bool more = true; more;) {
        const bool by_publisher = trickle(slow, "x"), by_viewer = trickle(slow_viewer, "x");
        more = by_publisher || by_viewer;
        publisher.send(live_tracked(++frame));
        EXPECT_EQ(viewer.next_frame(), frame);
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    for (const char* cause : {"publisher_slow", "viewer_slow"})
        EXPECT_TRUE(metrics_come_to("htvm_refused_total{cause=\"" + std::string(cause) + "\"} 1")) << get("/metrics");
    // Whoever was cut off holds no memory any more: only what is kept of ben's stream does.
    publisher.send(live_intra(++frame));
    EXPECT_EQ(viewer.next_frame(), frame);
    const auto kept = write_packet(live_header(1)).size() + write_packet(live_header(2)).size() +
                      write_packet(live_intra(frame)).size();
    EXPECT_TRUE(soon([&] { return hub.counters().memory == kept; })) << hub.counters().memory << ' ' << kept;
}

class QuickLiveConnectionTest : public LiveConnectionTest {
protected:
    QuickLiveConnectionTest() : LiveConnectionTest(HubLimits{.publisher_silence = std::chrono::milliseconds(300)}) {}
};

TEST_F(QuickLiveConnectionTest, ASilentPublisherIsCutOffAndOneWhoseHeartBeatsIsNot) {
    auto silent = open("/publish/anna"), alive = open("/publish/ben");
    silent.send(live_header(1));
    alive.send(live_header(2));
    std::thread cut_off([&] { EXPECT_EQ(silent.closing(), "1013 nothing was heard of the publisher"); });
    for (int i = 0; i < 30; ++i) {
        alive.say(R"({"type":"heartbeat"})");
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    cut_off.join();
    alive.send(live_intra(0));
    auto viewer = open("/watch/ben");
    EXPECT_EQ(viewer.next_frame(), 0u);  // the header's
    EXPECT_NE(get("/api/streams").find(R"("name":"anna","packets":1,"published":false)"), std::string::npos);
}

}  // namespace
}  // namespace htvm::live
