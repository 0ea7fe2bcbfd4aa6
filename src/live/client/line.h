// A connection, with TLS or without: one type, so that HTTP and WebSockets are compiled once and work over both. What
// they go on with after a read or a write is held behind one type, too, so that TLS is compiled once, in line.cpp.
#pragma once

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <boost/container/static_vector.hpp>
#include <utility>
#include <variant>

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

    // Where there are very many buffers, the first are read into or written, as if there were no others.
    template <class Buffers, class Token>
    auto async_read_some(const Buffers& buffers, Token&& token) {
        return started<&Line::read_some>(first_of<boost::asio::mutable_buffer>(buffers), std::forward<Token>(token));
    }
    template <class Buffers, class Token>
    auto async_write_some(const Buffers& buffers, Token&& token) {
        return started<&Line::write_some>(first_of<boost::asio::const_buffer>(buffers), std::forward<Token>(token));
    }

    // How Boost.Beast ends the connection below a WebSocket.
    using Ended = boost::asio::any_completion_handler<void(boost::beast::error_code)>;
    void end(boost::beast::role_type role, Ended ended);

private:
    template <class Buffer>
    using Buffers = boost::container::static_vector<Buffer, 16>;
    using Done = boost::asio::any_completion_handler<void(boost::beast::error_code, std::size_t)>;
    void read_some(const Buffers<boost::asio::mutable_buffer>& buffers, Done done);
    void write_some(const Buffers<boost::asio::const_buffer>& buffers, Done done);

    template <class Buffer, class All>
    static Buffers<Buffer> first_of(const All& all) {
        Buffers<Buffer> out;
        const auto end = boost::asio::buffer_sequence_end(all);
        for (auto it = boost::asio::buffer_sequence_begin(all); it != end && out.size() < out.capacity(); ++it)
            out.push_back(*it);
        return out;
    }
    template <auto start, class Buffers, class Token>
    auto started(const Buffers& buffers, Token&& token) {
        return boost::asio::async_initiate<Token, void(boost::beast::error_code, std::size_t)>(
            [this](auto&& done, const Buffers& given) { (this->*start)(given, std::forward<decltype(done)>(done)); },
            token, buffers);
    }

    std::variant<boost::beast::tcp_stream, Secure> stream_;
};

// So that the kernel does not hide how slow the other side is: of what it takes, little may lie unsent.
void keep_kernel_buffers_small(Line& line);

template <class Handler>
void async_teardown(boost::beast::role_type role, Line& line, Handler&& handler) {
    line.end(role, std::forward<Handler>(handler));
}

}  // namespace htvm::live
