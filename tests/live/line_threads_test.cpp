// A server that spreads what connections read, encrypt and write over threads of their own: all is as without them.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <vector>

#include "live_packets.h"
#include "server_test.h"
#include "web_socket.h"

namespace htvm::live {
namespace {

class LineThreadsTest : public ServerTest {
protected:
    LineThreadsTest() {
        std::ofstream(root / "served" / "person.htvm") << std::string(300000, 'p');
        options.hub = &hub;
        options.line_threads = 3;
    }
    WebSocket open(const std::string& target) { return WebSocket::open(connect(), host, target); }

    Hub hub;
};

TEST_F(LineThreadsTest, EachOfManyViewersIsSentEveryPacketWhole) {
    constexpr std::uint32_t frames = 30;
    constexpr std::size_t large = 200000;  // many writes
    start();
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0, large));
    ASSERT_TRUE(soon([&] { return body(get("/api/streams")).find("\"packets\":2") != std::string::npos; }));
    std::vector<WebSocket> viewers;
    for (int i = 0; i < 12; ++i) viewers.push_back(open("/watch/anna"));
    for (auto& viewer : viewers) {
        EXPECT_EQ(viewer.next()->kind, PacketKind::sequence);
        EXPECT_EQ(viewer.next_bytes()->size(), large + packet_overhead);
    }
    for (std::uint32_t frame = 1; frame <= frames; ++frame) publisher.send(live_tracked(frame, 3000));
    for (auto& viewer : viewers)
        for (std::uint32_t frame = 1; frame <= frames; ++frame)
            EXPECT_EQ(*viewer.next_bytes(), [&] {
                const auto bytes = write_packet(live_tracked(frame, 3000));
                return std::string(bytes.begin(), bytes.end());
            }());
}

TEST_F(LineThreadsTest, FilesAreSentWholeAndConnectionsGoOn) {
    start();
    auto socket = connect();
    for (int i = 0; i < 3; ++i) {
        boost::asio::write(socket, boost::asio::buffer("GET /files/person.htvm HTTP/1.1\r\nHost: " + host + "\r\n" +
                                                       (i == 2 ? "Connection: close\r\n" : "") + "\r\n"));
        if (i == 2) break;
        std::string response;
        boost::asio::read_until(socket, boost::asio::dynamic_buffer(response), "\r\n\r\n");
        response.erase(0, response.find("\r\n\r\n") + 4);
        boost::asio::read(socket, boost::asio::dynamic_buffer(response),
                          boost::asio::transfer_exactly(300000 - response.size()));
        EXPECT_EQ(response, std::string(300000, 'p'));
    }
    EXPECT_EQ(body(read_all(socket)).size(), 300000u);
}

TEST_F(LineThreadsTest, WhoTakesTooLongForARequestIsToldSo) {
    options.header_time = std::chrono::seconds(1);
    start();
    auto socket = connect();
    boost::asio::write(socket, boost::asio::buffer(std::string("GET / HT")));
    EXPECT_EQ(status(read_all(socket)), 408);
    EXPECT_TRUE(metrics_come_to("htvm_refused_total{cause=\"header_time\"} 1"));
}

TEST_F(LineThreadsTest, AllAreToldOfTheEnd) {
    start();
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    ASSERT_TRUE(soon([&] { return body(get("/api/streams")).find("\"packets\":2") != std::string::npos; }));
    std::vector<WebSocket> viewers;
    for (int i = 0; i < 6; ++i) viewers.push_back(open("/watch/anna"));
    for (auto& viewer : viewers) EXPECT_TRUE(viewer.next());
    ASSERT_EQ(std::raise(SIGTERM), 0);
    EXPECT_EQ(publisher.closing_code(), 1001u);
    for (auto& viewer : viewers) EXPECT_EQ(viewer.closing_code(), 1001u);
    thread.join();
}

// Whatever waits then, on whichever thread, is let go.
TEST_F(LineThreadsTest, AServerEndsWhileItsViewersDoNotRead) {
    start();
    auto publisher = open("/publish/anna");
    publisher.send(live_header(1));
    publisher.send(live_intra(0));
    ASSERT_TRUE(soon([&] { return body(get("/api/streams")).find("\"packets\":2") != std::string::npos; }));
    std::vector<WebSocket> viewers;
    for (int i = 0; i < 6; ++i) viewers.push_back(open("/watch/anna"));
    auto idle = connect();
    for (std::uint32_t frame = 1; frame <= 20; ++frame) publisher.send(live_tracked(frame, 100000));
    ASSERT_TRUE(soon([&] { return body(get("/api/streams")).find("\"packets\":22") != std::string::npos; }));
    stop();
    server.reset();
    EXPECT_EQ(read_all(idle), "");
}

}  // namespace
}  // namespace htvm::live
