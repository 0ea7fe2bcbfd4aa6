#include "live/client/line.h"

#include <netinet/tcp.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>

namespace htvm::live {

namespace net = boost::asio;
namespace beast = boost::beast;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::chrono::seconds leave_time{1};

beast::tcp_stream& Line::next_layer() {
    if (auto* tls = secure()) return tls->next_layer();
    return std::get<beast::tcp_stream>(stream_);
}

net::awaitable<beast::error_code> Line::handshake(net::ssl::stream_base::handshake_type side) {
    auto* tls = secure();
    if (!tls) co_return beast::error_code();
    const auto [error] = co_await tls->async_handshake(side, awaited);
    co_return error;
}

net::awaitable<void> Line::close() {
    if (auto* tls = secure()) {
        next_layer().expires_after(leave_time);
        co_await tls->async_shutdown(awaited);
    }
    beast::error_code ignored;
    next_layer().socket().shutdown(net::ip::tcp::socket::shutdown_both, ignored);
}

// What a read or a write goes on with runs where the line does; its own executor could not be asked for all that
// Boost.Beast asks for.
void Line::read_some(const Buffers<net::mutable_buffer>& buffers, Done done) {
    auto here = net::bind_executor(get_executor(), std::move(done));
    if (auto* tls = secure()) return tls->async_read_some(buffers, std::move(here));
    next_layer().async_read_some(buffers, std::move(here));
}

void Line::write_some(const Buffers<net::const_buffer>& buffers, Done done) {
    auto here = net::bind_executor(get_executor(), std::move(done));
    if (auto* tls = secure()) return tls->async_write_some(buffers, std::move(here));
    next_layer().async_write_some(buffers, std::move(here));
}

void Line::end(beast::role_type role, Ended ended) {
    using beast::websocket::async_teardown;
    auto here = net::bind_executor(get_executor(), std::move(ended));
    if (auto* tls = secure()) return async_teardown(role, *tls, std::move(here));
    async_teardown(role, next_layer().socket(), std::move(here));
}

void keep_kernel_buffers_small(Line& line) {
    constexpr int unsent = 16384, sent = 131072;
    auto& socket = line.next_layer().socket();
    beast::error_code ignored;
    socket.set_option(net::ip::tcp::no_delay(true), ignored);
    socket.set_option(net::socket_base::send_buffer_size(sent), ignored);
    ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
}

}  // namespace htvm::live
