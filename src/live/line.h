// A connection, with TLS or without: one type, so that HTTP and WebSockets are compiled once and work over both.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <string>
#include <utility>
#include <variant>

#include "htvm/result.hpp"

namespace htvm::live {

// Meets the requirements of Boost.Asio for asynchronous streams and those of Boost.Beast for what lies below a
// WebSocket.
class Line {
public:
    using next_layer_type = boost::beast::tcp_stream;
    using executor_type = next_layer_type::executor_type;
    using Secure = boost::beast::ssl_stream<boost::beast::tcp_stream>;

    explicit Line(boost::beast::tcp_stream tcp) : stream_(std::move(tcp)) {}
    // With TLS, by the certificates and rules that the context has now; it need not live any longer. handshake() comes
    // before everything else.
    Line(boost::beast::tcp_stream tcp, boost::asio::ssl::context& context)
        : stream_(std::in_place_type<Secure>, std::move(tcp), context) {}

    // Agrees on keys, within the time that is set for the TCP connection. Nothing to do without TLS.
    boost::asio::awaitable<boost::beast::error_code> handshake(boost::asio::ssl::stream_base::handshake_type side);
    // Takes leave of the other side, which has a second for its part, and closes the connection.
    boost::asio::awaitable<void> close();

    // The TCP connection below: its time limits, its socket.
    boost::beast::tcp_stream& next_layer();
    // The TLS above it; null without.
    Secure* secure() { return std::get_if<Secure>(&stream_); }
    executor_type get_executor() { return next_layer().get_executor(); }

    template <class Buffers, class Token>
    auto async_read_some(const Buffers& buffers, Token&& token) {
        if (auto* tls = secure()) return tls->async_read_some(buffers, std::forward<Token>(token));
        return next_layer().async_read_some(buffers, std::forward<Token>(token));
    }
    template <class Buffers, class Token>
    auto async_write_some(const Buffers& buffers, Token&& token) {
        if (auto* tls = secure()) return tls->async_write_some(buffers, std::forward<Token>(token));
        return next_layer().async_write_some(buffers, std::forward<Token>(token));
    }

private:
    std::variant<boost::beast::tcp_stream, Secure> stream_;
};

// So that the kernel does not hide how slow the other side is: of what it takes, little may lie unsent.
void keep_kernel_buffers_small(Line& line);

// For the side that others connect to: TLS 1.2 and 1.3, with the certificate chain and the private key of two PEM
// files. bad_input if they cannot be read or do not belong together.
Result<boost::asio::ssl::context> server_context(const std::string& certificate, const std::string& private_key);

// How Boost.Beast ends the connection below a WebSocket.
template <class Handler>
void async_teardown(boost::beast::role_type role, Line& line, Handler&& handler) {
    using boost::beast::websocket::async_teardown;
    if (auto* tls = line.secure())
        async_teardown(role, *tls, std::forward<Handler>(handler));
    else
        async_teardown(role, line.next_layer().socket(), std::forward<Handler>(handler));
}

}  // namespace htvm::live
