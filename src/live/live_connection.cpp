#include "live/live_connection.h"

#include <netinet/tcp.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/chunk_encode.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <memory>
#include <utility>

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

constexpr auto awaited = net::as_tuple(net::use_awaitable);

// A viewer who pauses for some seconds comes back; a line that is dead does not.
constexpr std::chrono::seconds silence{30}, handshake{10};
constexpr std::size_t control_bytes = 4096;  // of a message that is no packet

// The kernel must not hide how slow a viewer is: of what it takes, little may lie unsent.
void keep_kernel_buffers_small(Line& line) {
    constexpr int unsent = 16384, sent = 131072;
    auto& socket = line.next_layer().socket();
    beast::error_code ignored;
    socket.set_option(net::ip::tcp::no_delay(true), ignored);
    socket.set_option(net::socket_base::send_buffer_size(sent), ignored);
    ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
}

// What a viewer's coroutine waits for: packets, or the end.
struct News {
    net::steady_timer timer;  // cancelled when there are some
    bool ended = false;
    std::string reason{};  // why, for the other side
    explicit News(const net::any_io_executor& executor) : timer(executor) {}
    void end(const std::string& why) {
        if (reason.empty()) reason = why;
        ended = true;
        timer.cancel();
    }
    net::awaitable<void> wait() {
        timer.expires_at(std::chrono::steady_clock::time_point::max());
        co_await timer.async_wait(awaited);
    }
};

struct Connection {
    websocket::stream<Line> socket;
    News news;
    explicit Connection(Line line) : socket(std::move(line)), news(socket.get_executor()) {}
};
using SharedConnection = std::shared_ptr<Connection>;

net::awaitable<bool> accepted(Connection& connection, const LiveRequest& request, std::size_t largest_message) {
    auto& socket = connection.socket;
    beast::get_lowest_layer(socket).expires_never();
    socket.set_option(websocket::stream_base::timeout{handshake, silence, true});
    socket.read_message_max(largest_message);
    socket.auto_fragment(false);  // a packet is one write, not one for each 4 KB
    const auto offered = request[http::field::sec_websocket_protocol];
    const bool ours = http::token_list(offered).exists(live_protocol);
    socket.set_option(websocket::stream_base::decorator([ours](websocket::response_type& response) {
        if (ours) response.set(http::field::sec_websocket_protocol, live_protocol);
    }));
    const auto [error] = co_await socket.async_accept(request, awaited);
    co_return !error;
}

net::awaitable<void> close(SharedConnection connection, websocket::close_code code, std::string reason) {
    constexpr std::size_t longest_reason = 120;
    co_await connection->socket.async_close(websocket::close_reason(code, reason.substr(0, longest_reason)), awaited);
}

// Reads what a viewer sends, so that pings and the end of the connection are noticed.
net::awaitable<void> listen_to_viewer(SharedConnection connection) {
    beast::flat_buffer buffer(control_bytes);
    for (;;) {
        buffer.clear();
        const auto [error, bytes] = co_await connection->socket.async_read(buffer, awaited);
        if (error) break;
    }
    connection->news.end("");
}

// Takes leave of the hub however the coroutine ends: when the server stops, it is destroyed where it waits.
struct Leave {
    std::function<void()> leave;
    explicit Leave(std::function<void()> given) : leave(std::move(given)) {}
    Leave(const Leave&) = delete;
    Leave& operator=(const Leave&) = delete;
    ~Leave() { leave(); }
};

// news: lives as long as the owner that it is shared with.
Result<Hub::Viewer> watch(Hub& hub, const std::string& name, const std::shared_ptr<News>& news) {
    return hub.watch(
        name, [news] { news->timer.cancel(); }, [news] { news->end("the stream has ended"); }, Hub::Clock::now());
}

}  // namespace

net::awaitable<void> publish_by_socket(Line line, LiveRequest request, std::string name, Hub& hub) {
    const auto connection = std::make_shared<Connection>(std::move(line));
    auto& socket = connection->socket;
    const std::size_t largest = hub.limits().packet_bytes + packet_overhead;
    if (!co_await accepted(*connection, request, largest)) co_return;
    const std::weak_ptr<Connection> mine = connection;
    const auto publisher = hub.publish(name, [mine](const std::string& reason) {
        const auto replaced = mine.lock();
        if (!replaced) return;
        net::co_spawn(replaced->socket.get_executor(), close(replaced, websocket::close_code::policy_error, reason),
                      net::detached);
    });
    if (!publisher) {
        co_await close(connection, websocket::close_code::try_again_later, publisher.error().message);
        co_return;
    }
    const Leave leave([&hub, &publisher] { hub.leave(*publisher, Hub::Clock::now()); });
    beast::flat_buffer buffer(largest);
    for (;;) {
        buffer.clear();
        const auto [error, bytes] = co_await socket.async_read(buffer, awaited);
        if (error) break;
        if (!socket.got_binary()) continue;
        const auto* begin = static_cast<const std::uint8_t*>(buffer.cdata().data());
        const auto taken = hub.take(*publisher, {begin, begin + bytes}, Hub::Clock::now());
        if (taken) continue;
        co_await close(connection, websocket::close_code::policy_error, taken.error().message);
        break;
    }
}

net::awaitable<void> watch_by_socket(Line line, LiveRequest request, std::string name, Hub& hub) {
    keep_kernel_buffers_small(line);
    const auto connection = std::make_shared<Connection>(std::move(line));
    auto& socket = connection->socket;
    if (!co_await accepted(*connection, request, control_bytes)) co_return;
    auto& news = connection->news;
    const auto viewer = watch(hub, name, {connection, &news});
    if (!viewer) {
        co_await close(connection, websocket::close_code::policy_error, viewer.error().message);
        co_return;
    }
    const Leave leave([&hub, &viewer] { hub.leave(*viewer); });
    net::co_spawn(socket.get_executor(), listen_to_viewer(connection), net::detached);
    socket.binary(true);
    while (!news.ended) {
        const auto packet = hub.next(*viewer);
        if (!packet) {
            co_await news.wait();
            continue;
        }
        const auto [error, bytes] = co_await socket.async_write(net::buffer(packet->bytes), awaited);
        if (error) break;
    }
    hub.leave(*viewer);  // nothing waits for it while the connection is closed
    if (!news.reason.empty()) co_await close(connection, websocket::close_code::going_away, news.reason);
}

net::awaitable<void> watch_by_body(Line& line, http::response<http::empty_body> header, std::string name, Hub& hub) {
    keep_kernel_buffers_small(line);
    const auto news = std::make_shared<News>(line.get_executor());
    const auto viewer = watch(hub, name, news);
    const Leave leave([&hub, &viewer] {
        if (viewer) hub.leave(*viewer);
    });
    header.keep_alive(false);
    if (viewer) {
        header.set(http::field::content_type, "application/octet-stream");
        header.set(http::field::cache_control, "no-store");
        header.chunked(true);
    } else {
        header.result(viewer.error().kind == ErrorKind::limit ? http::status::service_unavailable
                                                              : http::status::not_found);
        header.content_length(0);
    }
    http::response_serializer<http::empty_body> serializer(header);
    line.next_layer().expires_after(silence);
    const auto [begun, header_bytes] = co_await http::async_write_header(line, serializer, awaited);
    if (!viewer) co_return;
    while (!begun && !news->ended) {
        const auto packet = hub.next(*viewer);
        if (!packet) {
            line.next_layer().expires_never();
            co_await news->wait();
            continue;
        }
        line.next_layer().expires_after(silence);
        const auto [error, bytes] = co_await net::async_write(
            line, http::make_chunk(net::const_buffer(packet->bytes.data(), packet->bytes.size())), awaited);
        if (error) break;
    }
    if (news->ended) co_await net::async_write(line, http::make_chunk_last(), awaited);
}

}  // namespace htvm::live
