// Publishing and watching over real connections, on this machine's loopback address.
#include "live/live_connection.h"

#include <gtest/gtest.h>

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <filesystem>
#include <optional>
#include <thread>

#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"
#include "live/file_server.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using namespace packet_flag;

Packet packet(PacketKind kind, std::uint32_t frame, std::uint32_t reference, std::uint8_t flags, std::size_t bytes) {
    Packet out;
    out.kind = kind;
    out.frame = frame;
    out.reference = reference;
    out.flags = static_cast<std::uint8_t>(told | flags);
    out.payload.assign(bytes, static_cast<std::uint8_t>(frame));
    return out;
}
Packet header(std::uint32_t session_number) { return packet(PacketKind::sequence, 0, session_number, session, 40); }
Packet intra(std::uint32_t frame, std::size_t bytes = 300) {
    return packet(PacketKind::intra, frame, frame, referred | access, bytes);
}
Packet tracked(std::uint32_t frame, std::size_t bytes = 100) {
    return packet(PacketKind::tracked, frame, frame - 1, referred, bytes);
}

class LiveConnectionTest : public testing::Test {
protected:
    void SetUp() override {
        options.folder = std::filesystem::temp_directory_path().string();
        options.hub = &hub;
        auto opened = FileServer::open(options);
        ASSERT_TRUE(opened) << opened.error().message;
        server.emplace(std::move(*opened));
        thread = std::thread([this] { server->run(); });
    }
    void TearDown() override {
        server->stop();
        thread.join();
    }

    tcp::socket connect() {
        tcp::socket socket(context);
        socket.connect({net::ip::make_address("127.0.0.1"), server->port()});
        return socket;
    }

    struct Socket {
        websocket::stream<tcp::socket> stream;
        void send(const Packet& packet) {
            const auto bytes = write_packet(packet);
            stream.binary(true);
            stream.write(net::buffer(bytes));
        }
        // The next packet's header; why the server closed the connection, if it did.
        std::optional<PacketHeader> next(std::string* reason = nullptr) {
            beast::flat_buffer buffer;
            beast::error_code error;
            const auto bytes = stream.read(buffer, error);
            if (error) {
                if (reason) *reason = std::string(stream.reason().reason.c_str());
                return std::nullopt;
            }
            std::uint32_t payload = 0;
            const auto* begin = static_cast<const std::uint8_t*>(buffer.cdata().data());
            return read_packet_header({begin, bytes}, payload);
        }
        std::uint32_t next_frame() {
            const auto header = next();
            return header ? header->frame : 9999;
        }
        std::string refusal() {
            std::string out;
            while (next(&out)) {
            }
            return out;
        }
    };
    Socket open(const std::string& target) {
        Socket out{websocket::stream<tcp::socket>(connect())};
        out.stream.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
            request.set(beast::http::field::sec_websocket_protocol, live_protocol);
        }));
        websocket::response_type response;
        out.stream.handshake(response, "127.0.0.1", target);
        EXPECT_EQ(response[beast::http::field::sec_websocket_protocol], live_protocol);
        return out;
    }

    // Waits until the server has told that many packets, since messages arrive when they arrive.
    void wait_for_packets(std::uint64_t count) {
        for (int i = 0; i < 1000; ++i) {
            if (get("/api/streams").find("\"packets\":" + std::to_string(count) + ",") != std::string::npos) return;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        FAIL() << get("/api/streams");
    }
    std::string get(const std::string& target) {
        auto socket = connect();
        net::write(socket, net::buffer("GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"));
        std::string out;
        beast::error_code error;
        net::read(socket, net::dynamic_buffer(out), error);
        return out;
    }

    Hub hub{HubLimits{.streams = 2}};
    FileServerOptions options;
    std::optional<FileServer> server;
    std::thread thread;
    net::io_context context;
};

TEST_F(LiveConnectionTest, WhatIsPublishedIsWatchedByEverybodyLateOnesToo) {
    auto publisher = open("/publish/anna");
    publisher.send(header(1));
    publisher.send(intra(0));
    publisher.send(tracked(1));
    wait_for_packets(3);
    auto late = open("/watch/anna");
    EXPECT_EQ(late.next()->kind, PacketKind::sequence);
    EXPECT_EQ(late.next_frame(), 0u);
    EXPECT_EQ(late.next_frame(), 1u);
    publisher.send(tracked(2));
    EXPECT_EQ(late.next_frame(), 2u);
    EXPECT_NE(get("/api/streams").find(R"("name":"anna","packets":4,"published":true)"), std::string::npos);
}

TEST_F(LiveConnectionTest, TheEndlessBodyHasTheSamePackets) {
    auto publisher = open("/publish/anna");
    publisher.send(header(1));
    publisher.send(intra(0));
    wait_for_packets(2);
    auto socket = connect();
    net::write(socket, net::buffer(std::string("GET /watch/anna HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")));
    publisher.send(tracked(1));
    const auto chunk = [](const Packet& packet) {
        const auto bytes = write_packet(packet);
        std::array<char, 16> size{};
        std::snprintf(size.data(), size.size(), "%zx\r\n", bytes.size());
        return size.data() + std::string(bytes.begin(), bytes.end()) + "\r\n";
    };
    const auto expected = chunk(header(1)) + chunk(intra(0)) + chunk(tracked(1));
    std::string got;
    while (got.find("\r\n\r\n") == std::string::npos || got.size() < got.find("\r\n\r\n") + 4 + expected.size()) {
        std::array<char, 4096> piece{};
        got.append(piece.data(), socket.read_some(net::buffer(piece)));
    }
    EXPECT_EQ(got.substr(0, 15), "HTTP/1.1 200 OK");
    EXPECT_EQ(got.substr(got.find("\r\n\r\n") + 4), expected);
}

TEST_F(LiveConnectionTest, WhatCannotBeIsRefusedWithAReason) {
    EXPECT_EQ(open("/watch/nobody").refusal(), "there is no stream 'nobody'");
    EXPECT_EQ(get("/watch/nobody").substr(0, 22), "HTTP/1.1 404 Not Found");
    auto first = open("/publish/anna");
    first.send(header(1));
    wait_for_packets(1);
    auto second = open("/publish/anna");
    second.send(header(2));
    EXPECT_EQ(second.refusal(), "'anna' is being published by another session; end that one, or wait");
    auto headless = open("/publish/ben");
    headless.send(intra(0));
    EXPECT_EQ(headless.refusal(), "the first packet must be a sequence header of version 2");
    auto again = open("/publish/anna");
    again.send(header(1));
    EXPECT_EQ(first.refusal(), "this session was continued by another connection");
    again.send(intra(0));
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
        stream.handshake(response, "127.0.0.1", "/publish/anna", error);
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
    publisher.send(header(1));
    publisher.send(intra(0));
    wait_for_packets(2);
    auto paused = open("/watch/anna"), quick = open("/watch/anna");
    EXPECT_EQ(quick.next()->kind, PacketKind::sequence);
    constexpr std::uint32_t frames = 300;
    for (std::uint32_t i = 0; i < frames; ++i) {
        if (i > 0) publisher.send(i % 30 == 0 ? intra(i, 60000) : tracked(i, 30000));
        ASSERT_EQ(quick.next_frame(), i);
    }
    // Of nine megabytes it gets what the buffers on the way held, and then the newest I-frame with what followed.
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

TEST_F(LiveConnectionTest, ManyViewersGetTheSame) {
    auto publisher = open("/publish/anna");
    publisher.send(header(1));
    wait_for_packets(1);
    std::vector<Socket> viewers;
    for (int i = 0; i < 50; ++i) viewers.push_back(open("/watch/anna"));
    for (std::uint32_t i = 0; i < 10; ++i) publisher.send(i == 0 ? intra(0) : tracked(i));
    for (auto& viewer : viewers) {
        EXPECT_EQ(viewer.next()->kind, PacketKind::sequence);
        for (std::uint32_t i = 0; i < 10; ++i) ASSERT_EQ(viewer.next_frame(), i);
    }
}

}  // namespace
}  // namespace htvm::live
