// A WebSocket of a test's client.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "htvm/packet.hpp"
#include "live/client/control.h"

namespace htvm::live {

struct WebSocket {
    boost::beast::websocket::stream<boost::asio::ip::tcp::socket> stream;
    unsigned status = 0;  // of the response to its request; 101: it was opened

    // name, value: of a header.
    static WebSocket open(boost::asio::ip::tcp::socket socket, const std::string& host, const std::string& target,
                          const std::string& name = "", const std::string& value = "") {
        namespace beast = boost::beast;
        WebSocket out{decltype(stream)(std::move(socket))};
        out.stream.set_option(beast::websocket::stream_base::decorator([&](beast::websocket::request_type& request) {
            request.set(beast::http::field::sec_websocket_protocol, live_protocol);
            if (!name.empty()) request.set(name, value);
        }));
        beast::websocket::response_type response;
        beast::error_code error;
        out.stream.handshake(response, host, target, error);
        out.status = response.result_int();
        if (!error) {
            EXPECT_EQ(response[beast::http::field::sec_websocket_protocol], live_protocol);
        }
        return out;
    }

    void send(const Packet& packet) {
        const auto bytes = write_packet(packet);
        stream.binary(true);
        stream.write(boost::asio::buffer(bytes));
    }
    void say(const std::string& text) {
        stream.text(true);
        stream.write(boost::asio::buffer(text));
    }
    // The next message of either sort; nothing once the server has closed the connection.
    std::optional<std::string> read() {
        boost::beast::flat_buffer buffer;
        boost::beast::error_code error;
        stream.read(buffer, error);
        if (error) return std::nullopt;
        return boost::beast::buffers_to_string(buffer.data());
    }
    // The next packet; texts on the way are passed over.
    std::optional<std::string> next_bytes() {
        auto message = read();
        while (message && stream.got_text()) message = read();
        return message;
    }
    std::optional<PacketHeader> next() {
        const auto message = next_bytes();
        if (!message) return std::nullopt;
        std::uint32_t payload = 0;
        return read_packet_header({reinterpret_cast<const std::uint8_t*>(message->data()), message->size()}, payload);
    }
    std::uint32_t next_frame() {
        const auto header = next();
        return header ? header->frame : 9999;
    }
    // The next text of this type; packets and other texts on the way are passed over. "" if none comes.
    std::string next_text(const std::string& type) {
        for (auto message = read(); message; message = read())
            if (stream.got_text() && message->find("\"type\":\"" + type + '"') != std::string::npos) return *message;
        return "";
    }
    // The code by which the server closes the connection, 0 if by none; and "CODE REASON".
    unsigned closing_code() {
        while (next()) {
        }
        return stream.reason().code;
    }
    std::string closing() {
        const auto code = closing_code();
        return std::to_string(code) + ' ' + std::string(stream.reason().reason.c_str());
    }
};

}  // namespace htvm::live
