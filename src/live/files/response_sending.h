// Sends a response over a connection of any kind: a Line, or a TCP connection by itself.
#pragma once

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/write.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "live/files/response.h"

namespace htvm::live {

// stall_time: for the other side to take the next 64 KB. False if the connection is of no use any more.
template <class Connection>
boost::asio::awaitable<bool> send(Connection& connection, Response& response, bool with_body,
                                  std::chrono::seconds stall_time) {
    namespace net = boost::asio;
    namespace http = boost::beast::http;
    constexpr auto awaited = net::as_tuple(net::use_awaitable);
    constexpr std::size_t piece_bytes = 65536;
    auto& header = response.header;
    if (!response.own.empty()) response.content = response.own;
    if (response.shared) response.content = *response.shared;
    const bool text = response.file.file.descriptor() < 0;
    const auto count = text ? response.content.size() : response.count;
    if (header.result() != http::status::not_modified) header.set(http::field::content_length, std::to_string(count));
    http::response_serializer<http::empty_body> serializer(header);
    connection.expires_after(stall_time);
    if (const auto [error, bytes] = co_await http::async_write_header(connection, serializer, awaited); error)
        co_return false;
    if (!with_body) co_return true;
    std::vector<char> piece(text ? 0 : std::min<std::uint64_t>(piece_bytes, count));
    for (std::uint64_t sent = 0; sent < count;) {
        std::string_view next;
        if (text) {
            next = response.content.substr(sent, piece_bytes);
        } else {
            const auto wanted = std::min<std::uint64_t>(piece.size(), count - sent);
            next = {piece.data(), response.file.file.read(response.first + sent, {piece.data(), wanted})};
        }
        if (next.empty()) co_return false;  // the file has become shorter than was promised
        connection.expires_after(stall_time);
        const auto [error, bytes] = co_await net::async_write(connection, net::buffer(next), awaited);
        if (error) co_return false;
        sent += bytes;
    }
    co_return true;
}

}  // namespace htvm::live
