// Publishers and watchers with hubs in the same process, over the loopback address: what arrives, what a lost hub
// costs, and what a hub that means harm can do.
#include "htvm/publisher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <future>
#include <optional>
#include <thread>

#include "htvm/watcher.hpp"
#include "live/client/control.h"
#include "live/server/server.h"
#include "live_packets.h"
#include "soon.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using std::chrono::milliseconds;

// A hub that can be killed, and started again where it was.
class TestHub {
public:
    explicit TestHub(std::uint16_t port = 0) {
        ServerOptions options;
        options.port = port;
        options.hub = &hub_;
        auto opened = Server::open(options);
        EXPECT_TRUE(opened) << opened.error().message;
        server_.emplace(std::move(*opened));
        thread_ = std::thread([this] { server_->run(); });
    }
    ~TestHub() {
        server_->stop();
        thread_.join();
    }
    std::uint16_t port() const { return server_->port(); }
    std::string url(const std::string& path) const { return "ws://127.0.0.1:" + std::to_string(port()) + path; }

private:
    Hub hub_;
    std::optional<Server> server_;
    std::thread thread_;
};

// A server that does to each connection what it is told.
class FakeHub {
public:
    explicit FakeHub(std::function<void(tcp::socket)> serve) : serve_(std::move(serve)) {
        acceptor_.listen();
        thread_ = std::thread([this] {
            for (;;) {
                beast::error_code error;
                tcp::socket socket(context_);
                acceptor_.accept(socket, error);
                if (over_) return;
                if (!error) serve_(std::move(socket));
            }
        });
    }
    ~FakeHub() {
        over_ = true;
        beast::error_code ignored;
        tcp::socket last(context_);
        last.connect(acceptor_.local_endpoint(), ignored);
        thread_.join();
    }
    std::string url(const std::string& path) const {
        return "ws://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + path;
    }

private:
    std::function<void(tcp::socket)> serve_;
    std::atomic<bool> over_ = false;
    net::io_context context_;
    tcp::acceptor acceptor_{context_, {net::ip::make_address("127.0.0.1"), 0}};
    std::thread thread_;
};

using Socket = websocket::stream<tcp::socket>;

// One that speaks the protocol up to here.
std::function<void(tcp::socket)> accepting(std::function<void(Socket&)> talk) {
    return [talk = std::move(talk)](tcp::socket socket) {
        Socket stream(std::move(socket));
        stream.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
            response.set(beast::http::field::sec_websocket_protocol, live_protocol);
        }));
        beast::error_code error;
        stream.accept(error);
        if (!error) talk(stream);
        stream.next_layer().close(error);
    };
}

void send(Socket& socket, const std::vector<std::uint8_t>& bytes) {
    beast::error_code ignored;
    socket.binary(true);
    socket.write(net::buffer(bytes), ignored);
}
void send(Socket& socket, const std::string& text) {
    beast::error_code ignored;
    socket.text(true);
    socket.write(net::buffer(text), ignored);
}

std::optional<Packet> next(Watcher& watcher) {
    auto packet = watcher.next();
    EXPECT_TRUE(packet) << packet.error().message;
    return packet ? std::move(*packet) : std::nullopt;
}
std::uint32_t next_frame(Watcher& watcher) {
    for (;;) {
        const auto packet = next(watcher);
        if (!packet) return 9999;
        if (packet->kind != PacketKind::sequence) return packet->frame;
    }
}

TEST(Publisher, WhatIsPublishedIsWatchedByteByByte) {
    const TestHub hub;
    auto publisher = Publisher::open(hub.url("/publish/anna")).value();
    auto watcher = Watcher::open(hub.url("/watch/anna")).value();
    std::vector<Packet> sent = {live_header(7), live_intra(0)};
    for (std::uint32_t k = 1; k < 20; ++k) sent.push_back(live_tracked(k));
    for (const auto& packet : sent) ASSERT_TRUE(publisher.send(packet));
    for (const auto& packet : sent) {
        const auto came = next(watcher);
        ASSERT_TRUE(came);
        EXPECT_EQ(write_packet(*came), write_packet(packet));
    }
    EXPECT_TRUE(publisher.finish());
    EXPECT_EQ(publisher.state().sent_packets, sent.size());
    EXPECT_EQ(publisher.state().dropped_frames, 0u);
}

TEST(Watcher, WaitsNoLongerThanItIsToldAndEndsWhereItIsStopped) {
    const TestHub hub;
    auto watcher = Watcher::open(hub.url("/watch/anna")).value();
    const auto none = watcher.next(milliseconds(20));
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().kind, ErrorKind::limit);
    auto waiting = std::async(std::launch::async, [&] { return watcher.next(); });
    watcher.stop();
    const auto ended = waiting.get();
    ASSERT_TRUE(ended) << ended.error().message;
    EXPECT_FALSE(*ended);
}

TEST(Watcher, ARefusalEndsItAtOnce) {
    std::atomic<int> connections = 0;
    const FakeHub hub(accepting([&](Socket& socket) {
        ++connections;
        beast::error_code ignored;
        socket.close({beast::websocket::close_code::policy_error, "this needs a link"}, ignored);
    }));
    auto watcher = Watcher::open(hub.url("/watch/anna")).value();
    const auto came = watcher.next();
    ASSERT_FALSE(came);
    EXPECT_NE(came.error().message.find("this needs a link"), std::string::npos) << came.error().message;
    EXPECT_EQ(connections, 1);
}

TEST(Publisher, AHubThatIsKilledAndBackIsSentWhatTheNewestFrameNeeds) {
    std::optional<TestHub> hub(std::in_place);
    const auto port = hub->port();
    auto publisher = Publisher::open(hub->url("/publish/anna")).value();
    auto watcher = Watcher::open(hub->url("/watch/anna")).value();
    ASSERT_TRUE(publisher.send(live_header(7)));
    ASSERT_TRUE(publisher.send(live_intra(0)));
    ASSERT_TRUE(publisher.send(live_tracked(1)));
    EXPECT_EQ(next_frame(watcher), 0u);
    EXPECT_EQ(next_frame(watcher), 1u);
    hub.reset();
    EXPECT_TRUE(soon([&] {
        const auto state = publisher.state();
        return !state.connected && !state.trouble.empty();
    }));
    ASSERT_TRUE(publisher.send(live_tracked(2)));
    hub.emplace(port);
    EXPECT_TRUE(soon([&] { return publisher.state().connected; }));
    ASSERT_TRUE(publisher.send(live_tracked(3)));
    // The new hub was sent frames 0 and 1 again, since those behind need them; the watcher had them.
    EXPECT_EQ(next_frame(watcher), 2u);
    EXPECT_EQ(next_frame(watcher), 3u);
    EXPECT_EQ(publisher.state().connections, 2u);
}

TEST(Publisher, WhereAHubIsLostTheNextOfTheListIsTaken) {
    std::optional<TestHub> first(std::in_place);
    const TestHub second;
    auto publisher = Publisher::open(first->url("/publish/anna"), {.other_hubs = {second.url("")}}).value();
    ASSERT_TRUE(publisher.send(live_header(7)));
    ASSERT_TRUE(publisher.send(live_intra(0)));
    EXPECT_TRUE(soon([&] { return publisher.state().sent_packets == 2; }));
    first.reset();
    auto watcher = Watcher::open(second.url("/watch/anna")).value();
    EXPECT_EQ(next_frame(watcher), 0u);
    EXPECT_EQ(publisher.state().hub, second.url("/publish/anna"));
}

TEST(Publisher, ARefusedTokenEndsItWithTheHubsReason) {
    std::promise<std::string> asked;
    std::atomic<int> connections = 0;
    const FakeHub hub([&](tcp::socket socket) {
        std::string request;
        net::read_until(socket, net::dynamic_buffer(request), "\r\n\r\n");
        if (++connections == 1) asked.set_value(request);
        const std::string why = "no publisher has this token\n";
        net::write(socket, net::buffer("HTTP/1.1 401 Unauthorized\r\nContent-Length: " + std::to_string(why.size()) +
                                       "\r\n\r\n" + why));
    });
    auto publisher = Publisher::open(hub.url("/publish/anna?a=b"), {.token = "not-this-one"}).value();
    const auto request = asked.get_future().get();
    EXPECT_NE(request.find("Authorization: Bearer not-this-one\r\n"), std::string::npos);
    EXPECT_EQ(request.substr(0, 26), "GET /publish/anna?a=b HTTP");
    Result<void> sent;
    EXPECT_TRUE(soon([&] { return !(sent = publisher.send(live_header(7))); }));
    EXPECT_EQ(sent.error().message, hub.url("/publish/anna") + ": it answers 401: no publisher has this token");
    EXPECT_EQ(connections, 1);
}

TEST(Publisher, AHubThatTakesNothingHoldsNobodyUp) {
    std::promise<void> over;
    const auto until = over.get_future().share();
    const FakeHub hub(accepting([until](Socket&) { until.wait_for(std::chrono::seconds(20)); }));
    auto publisher = Publisher::open(hub.url("/publish/anna"), {.queue_bytes = 1 << 20}).value();
    EXPECT_TRUE(soon([&] { return publisher.state().connected; }));
    const auto begun = std::chrono::steady_clock::now();
    ASSERT_TRUE(publisher.send(live_header(7)));
    std::uint32_t frame = 0;
    for (int group = 0; group < 20; ++group) {
        ASSERT_TRUE(publisher.send(live_intra(frame++, 500000)));
        for (int k = 0; k < 5; ++k) ASSERT_TRUE(publisher.send(live_tracked(frame++, 100000)));
    }
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(2));
    EXPECT_LE(publisher.state().queue_bytes, std::size_t{1} << 20);
    EXPECT_GT(publisher.state().dropped_frames, 60u);
    EXPECT_FALSE(publisher.finish(milliseconds(50)));
    over.set_value();
}

TEST(Publisher, ARequestForAKeyFrameIsPassedOnOnce) {
    std::promise<void> over;
    const auto until = over.get_future().share();
    const FakeHub hub(accepting([until](Socket& socket) {
        send(socket, write_text(Hello{}));
        send(socket, write_text(KeyFrameRequest{}));
        send(socket, write_text(HeartbeatToPublisher{.viewers = 12}));
        until.wait_for(std::chrono::seconds(20));
    }));
    auto publisher = Publisher::open(hub.url("/publish/anna")).value();
    ASSERT_TRUE(publisher.send(live_header(7)));
    ASSERT_TRUE(publisher.send(live_intra(0)));
    EXPECT_TRUE(soon([&] { return publisher.state().viewers == 12u; }));
    EXPECT_TRUE(publisher.wants_key_frame());
    EXPECT_FALSE(publisher.wants_key_frame());
    over.set_value();
}

TEST(Publisher, TellsItsClockAndItsStamps) {
    std::promise<std::vector<std::string>> said;
    const FakeHub hub(accepting([&](Socket& socket) {
        std::vector<std::string> messages;
        beast::error_code error;
        while (!error && messages.size() < 5) {
            beast::flat_buffer buffer;
            socket.read(buffer, error);
            messages.push_back(socket.got_text() ? beast::buffers_to_string(buffer.cdata()) : "packet");
        }
        said.set_value(messages);
    }));
    auto publisher = Publisher::open(hub.url("/publish/anna"), {.stamps = true}).value();
    ASSERT_TRUE(publisher.send(live_header(7)));
    ASSERT_TRUE(publisher.send(live_intra(0)));
    const auto messages = said.get_future().get();
    ASSERT_EQ(messages.size(), 5u);
    EXPECT_EQ(messages[0], "packet");
    const auto stamp = read_from_publisher(messages[1]).value();
    ASSERT_TRUE(std::holds_alternative<Stamp>(stamp));
    EXPECT_EQ(std::get<Stamp>(stamp).frame, 0u);
    EXPECT_EQ(messages[2], "packet");
    // Behind the first frame at once, then each second.
    const auto first = read_from_publisher(messages[3]).value(), second = read_from_publisher(messages[4]).value();
    ASSERT_TRUE(std::holds_alternative<HeartbeatFromPublisher>(first));
    ASSERT_TRUE(std::holds_alternative<HeartbeatFromPublisher>(second));
    const auto clock = std::get<HeartbeatFromPublisher>(first).clock,
               later = std::get<HeartbeatFromPublisher>(second).clock;
    ASSERT_TRUE(clock && later);
    EXPECT_GE(*clock, 0);
    EXPECT_GT(*later, *clock);
}

TEST(Publisher, AddressesAndCertificatesAreCheckedAtOnce) {
    EXPECT_FALSE(Publisher::open("http://hub/publish/anna"));
    EXPECT_FALSE(Publisher::open("ws://hub/publish/anna", {.other_hubs = {"hub:80"}}));
    EXPECT_FALSE(Publisher::open("wss://hub/publish/anna", {.certificates = "/nowhere.pem"}));
}

TEST(Watcher, GarbageIsCountedAndPassedOver) {
    std::promise<void> over;
    const auto until = over.get_future().share();
    auto damaged = write_packet(live_intra(0));
    damaged[40] ^= 1;
    auto two = write_packet(live_intra(0));
    const auto other = write_packet(live_tracked(1));
    two.insert(two.end(), other.begin(), other.end());
    const FakeHub hub(accepting([&, until](Socket& socket) {
        send(socket, std::vector<std::uint8_t>(100, 0xA5));
        send(socket, damaged);
        send(socket, two);
        send(socket, std::vector<std::uint8_t>());
        send(socket, std::string("{\"type\":"));
        send(socket, std::string(100000, '['));
        send(socket, R"({"type":"hello","version":1,"stream":"a","hubs":["gopher://x","ws://"]})");
        send(socket, write_packet(live_header(7)));
        send(socket, write_packet(live_intra(0)));
        until.wait_for(std::chrono::seconds(20));
    }));
    auto watcher = Watcher::open(hub.url("/watch/anna")).value();
    EXPECT_EQ(next(watcher)->kind, PacketKind::sequence);
    EXPECT_EQ(next_frame(watcher), 0u);
    EXPECT_EQ(watcher.state().damaged_messages, 4u);
    over.set_value();
}

TEST(Watcher, AMessageThatIsTooLargeEndsTheConnectionNotTheWatcher) {
    std::atomic<int> connections = 0;
    std::promise<void> over;
    const auto until = over.get_future().share();
    const FakeHub hub(accepting([&, until](Socket& socket) {
        if (++connections == 1) return send(socket, std::vector<std::uint8_t>(100000, 1));
        send(socket, write_packet(live_header(7)));
        until.wait_for(std::chrono::seconds(20));
    }));
    WatcherOptions options;
    options.largest_packet = 10000;
    auto watcher = Watcher::open(hub.url("/watch/anna"), options).value();
    EXPECT_EQ(next(watcher)->kind, PacketKind::sequence);
    EXPECT_EQ(connections, 2);
    over.set_value();
}

TEST(Watcher, EndsWhereTheStreamDoes) {
    const FakeHub hub(accepting([](Socket& socket) {
        send(socket, write_packet(live_header(7)));
        beast::error_code ignored;
        socket.close(websocket::close_code::normal, ignored);
    }));
    auto watcher = Watcher::open(hub.url("/watch/anna")).value();
    EXPECT_EQ(next(watcher)->kind, PacketKind::sequence);
    EXPECT_FALSE(next(watcher));
}

TEST(Watcher, WhatTheHubSaysReachesTheTerminalWithoutItsControlCharacters) {
    const FakeHub hub([](tcp::socket socket) {
        std::string request;
        net::read_until(socket, net::dynamic_buffer(request), "\r\n\r\n");
        net::write(socket, net::buffer(std::string("HTTP/1.1 403 No\r\nContent-Length: 12\r\n\r\n\x1b[31mexpired")));
    });
    auto watcher = Watcher::open(hub.url("/watch/anna?signature=0123")).value();
    const auto refused = watcher.next();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, hub.url("/watch/anna") + ": it answers 403: [31mexpired");
}

TEST(Watcher, IsStoppedWhileItWaits) {
    std::atomic<bool> stopped = false;
    WatcherOptions options;
    options.is_stopped = [&] { return stopped.load(); };
    auto watcher = Watcher::open("ws://127.0.0.1:1/watch/anna", options).value();
    std::thread later([&] {
        std::this_thread::sleep_for(milliseconds(50));
        stopped = true;
    });
    EXPECT_FALSE(next(watcher));
    later.join();
}

}  // namespace
}  // namespace htvm::live
