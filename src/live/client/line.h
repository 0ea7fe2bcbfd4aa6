// A connection, with TLS or without: one type, so that HTTP and WebSockets are compiled once and work over both. What
// they go on with after a read or a write is held behind one type, too, so that TLS is compiled once, in line.cpp.
//
// Threads. A line is used on one thread, its home, like everything that belongs to a server. What takes time of it,
// the kernel's reading and writing and TLS's encrypting, may be done on another one: where the executor of the TCP
// connection that it is made of is not its home. Then each read, write, handshake and end is begun there and comes
// back; the line holds what both need.
#pragma once

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <boost/container/static_vector.hpp>
#include <chrono>
#include <memory>
#include <utility>

namespace htvm::live {

// Meets the requirements of Boost.Asio for asynchronous streams and those of Boost.Beast for what lies below a
// WebSocket.
class Line {
public:
    using executor_type = boost::asio::any_io_executor;
    using Secure = boost::beast::ssl_stream<boost::beast::tcp_stream>;

    // At home where the TCP connection is.
    explicit Line(boost::beast::tcp_stream tcp);
    // With TLS, by the certificates and rules that the context has now; it need not live any longer. handshake() comes
    // before everything else.
    Line(boost::beast::tcp_stream tcp, boost::asio::ssl::context& context);
    // context: null without TLS.
    Line(boost::beast::tcp_stream tcp, boost::asio::ssl::context* context, executor_type home);
    Line(Line&&) noexcept = default;
    Line& operator=(Line&&) = delete;
    ~Line();

    executor_type get_executor() const;

    // Agrees on keys. Nothing to do without TLS.
    boost::asio::awaitable<boost::beast::error_code> handshake(boost::asio::ssl::stream_base::handshake_type side);
    // Takes leave of the other side, which has a second for its part, and closes the connection.
    boost::asio::awaitable<void> close();
    // Closes it at once: what waits on it ends.
    void cut();
    // Ends what waits on it.
    void cancel();
    // What begins from here on, and all that begins until it is told otherwise, must be over by then; else it ends
    // with beast::error::timeout, and so does the connection. Nothing may wait on the line when this is called.
    void expires_after(std::chrono::steady_clock::duration time);
    void expires_never();
    // So that the kernel does not hide how slow the other side is: of what it takes, little may lie unsent. Nothing may
    // wait on the line.
    void keep_kernel_buffers_small();

    // The TLS of a line that is at home where its connection is; null without.
    Secure* secure();

    // Where there are very many buffers, the first are read into or written, as if there were no others.
    template <class Buffers, class Token>
    auto async_read_some(const Buffers& buffers, Token&& token) {
        return started<&Line::read_some>(first_of<boost::asio::mutable_buffer>(buffers), std::forward<Token>(token));
    }
    template <class Buffers, class Token>
    auto async_write_some(const Buffers& buffers, Token&& token) {
        return started<&Line::write_some>(first_of<boost::asio::const_buffer>(buffers), std::forward<Token>(token));
    }

    // What comes before TLS. The line must live longer.
    class BelowTls {
    public:
        using executor_type = Line::executor_type;
        explicit BelowTls(Line& line) : line_(line) {}
        executor_type get_executor() const { return line_.get_executor(); }
        template <class Buffers, class Token>
        auto async_read_some(const Buffers& buffers, Token&& token) {
            return line_.started<&Line::read_below_tls>(first_of<boost::asio::mutable_buffer>(buffers),
                                                        std::forward<Token>(token));
        }

    private:
        Line& line_;
    };

    // How Boost.Beast ends the connection below a WebSocket.
    using Ended = boost::asio::any_completion_handler<void(boost::beast::error_code)>;
    void end(boost::beast::role_type role, Ended ended);
    friend void beast_close_socket(Line& line) { line.cut(); }

private:
    struct State;
    template <class Buffer>
    using Buffers = boost::container::static_vector<Buffer, 16>;
    using Done = boost::asio::any_completion_handler<void(boost::beast::error_code, std::size_t)>;
    void read_some(const Buffers<boost::asio::mutable_buffer>& buffers, Done done);
    void read_below_tls(const Buffers<boost::asio::mutable_buffer>& buffers, Done done);
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

    std::shared_ptr<State> state_;  // null: moved from
};

template <class Handler>
void async_teardown(boost::beast::role_type role, Line& line, Handler&& handler) {
    line.end(role, std::forward<Handler>(handler));
}

}  // namespace htvm::live
