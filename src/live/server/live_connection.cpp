#include "live/server/live_connection.h"

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
#include <optional>
#include <span>
#include <string_view>
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
constexpr std::size_t piece_bytes = 65536;  // of a message that is being read

// What a coroutine that writes waits for: that there is something to write, or the end.
struct News {
    net::steady_timer timer;  // cancelled when there is
    bool writing = false;     // until the other side has taken it
    bool ended = false;       // the connection is of no use any more,
    bool in_order = false;    // since the other side took leave
    explicit News(const net::any_io_executor& executor) : timer(executor) {}
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

net::awaitable<bool> accepted(Connection& connection, const Request& request, std::size_t largest_message) {
    auto& socket = connection.socket;
    socket.next_layer().expires_never();
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

net::awaitable<void> close(Connection& connection, CloseCode code, const std::string& reason) {
    constexpr std::size_t longest_reason = 120;
    const websocket::close_reason why(static_cast<websocket::close_code>(code), reason.substr(0, longest_reason));
    co_await connection.socket.async_close(why, awaited);
}

// Reads messages until the connection ends, or one of these says that it should: receive_part(bytes), which is called
// for each piece with the memory that the message takes by then, and receive(text, message). receive_nothing(): called
// for each ping and its like; whoever goes on with them after it said no is cut off.
template <class ReceivePart, class Receive, class ReceiveNothing>
net::awaitable<void> read_messages(SharedConnection connection, ReceivePart receive_part, Receive receive,
                                   ReceiveNothing receive_nothing) {
    auto& socket = connection->socket;
    constexpr int patience = 100;  // each costs the hub an answer
    socket.control_callback(
        [&socket, receive_nothing, refused = 0](websocket::frame_type kind, beast::string_view) mutable {
            if (kind == websocket::frame_type::close || receive_nothing() || ++refused < patience) return;
            socket.next_layer().cut();
        });
    beast::flat_buffer buffer;
    for (bool wanted = true; wanted;) {
        buffer.clear();
        if (buffer.capacity() > piece_bytes) buffer.shrink_to_fit();
        beast::error_code failed;
        do {
            const auto [error, bytes] = co_await socket.async_read_some(buffer, piece_bytes, awaited);
            failed = error;
            wanted = receive_part(buffer.capacity());
        } while (!failed && wanted && !socket.is_message_done() &&
                 !(socket.got_text() && buffer.size() > most_text_bytes));
        if (failed) {
            connection->news.ended = true;
            connection->news.in_order = failed == websocket::error::closed;
            break;
        }
        wanted = wanted && receive(socket.got_text(),
                                   std::span(static_cast<const std::uint8_t*>(buffer.cdata().data()), buffer.size()));
    }
    connection->news.timer.cancel();
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// One writer writes texts and packets, one after the other.
net::awaitable<bool> write(Connection& connection, bool text, net::const_buffer message) {
    connection.socket.text(text);
    connection.news.writing = true;
    const auto [error, bytes] = co_await connection.socket.async_write(message, awaited);
    connection.news.writing = false;
    co_return !error;
}

// Writes what the hub has for the connection until it ends; next() gives that. Packets are shared, texts are made here.
template <class Next>
net::awaitable<void> write_messages(Connection& connection, Next next) {
    auto& news = connection.news;
    while (!news.ended) {
        const auto message = next();
        if (std::holds_alternative<std::monostate>(message)) {
            co_await news.wait();
            continue;
        }
        if (const auto* closing = std::get_if<Closing>(&message)) {
            if (closing->code) co_await close(connection, *closing->code, closing->reason);
            break;
        }
        std::string text;
        net::const_buffer bytes;
        std::visit(
            [&]<class Message>(const Message& value) {
                if constexpr (std::is_same_v<Message, SharedPacket>)
                    bytes = net::buffer(value->bytes);
                else if constexpr (!std::is_same_v<Message, std::monostate> && !std::is_same_v<Message, Closing>)
                    bytes = net::buffer(text = write_text(value));
            },
            message);
        if (!co_await write(connection, !text.empty(), bytes)) break;
    }
    // The reader ends with the line.
    connection.socket.next_layer().cut();
}

// Takes leave of the hub however the coroutine ends: when the server stops, it is destroyed where it waits.
struct Leave {
    std::function<void()> leave;
    explicit Leave(std::function<void()> given) : leave(std::move(given)) {}
    Leave(const Leave&) = delete;
    Leave& operator=(const Leave&) = delete;
    ~Leave() { leave(); }
};

}  // namespace

net::awaitable<void> publish_by_socket(Line line, Request request, std::string name, Hub& hub) {
    const auto connection = std::make_shared<Connection>(std::move(line));
    if (!co_await accepted(*connection, request, hub.limits().packet_bytes + packet_overhead)) co_return;
    auto& news = connection->news;
    const auto publisher = hub.publish(
        name, [&news] { news.timer.cancel(); }, Hub::Clock::now());
    if (!publisher) {
        co_await close(*connection, CloseCode::try_later, publisher.error().message);
        co_return;
    }
    const Leave leave([&hub, &publisher, connection] {
        if (connection->news.in_order) hub.lets_go(*publisher);
        hub.leave(*publisher, false, Hub::Clock::now());
    });
    const auto receive_part = [&hub, number = *publisher](std::size_t bytes) {
        return hub.receive_part(number, bytes, Hub::Clock::now()).has_value();
    };
    const auto receive = [&hub, number = *publisher](bool text, std::span<const std::uint8_t> message) {
        const auto now = Hub::Clock::now();
        return (text ? hub.receive_text(number, text_of(message), now)
                     : hub.receive_packet(number, {message.begin(), message.end()}, now))
            .has_value();
    };
    const auto receive_nothing = [&hub, number = *publisher] {
        return hub.receive_nothing(number, Hub::Clock::now()).has_value();
    };
    net::co_spawn(connection->socket.get_executor(), read_messages(connection, receive_part, receive, receive_nothing),
                  net::detached);
    co_await write_messages(*connection, [&] { return hub.next(*publisher); });
}

net::awaitable<void> watch_by_socket(Line line, Request request, std::string name, Hub& hub) {
    line.keep_kernel_buffers_small();
    const auto connection = std::make_shared<Connection>(std::move(line));
    if (!co_await accepted(*connection, request, most_text_bytes)) co_return;
    const WatchOptions options{.stamps = query_value(request.target(), "stamps").has_value()};
    auto& news = connection->news;
    std::optional<Hub::Viewer> watching;
    const auto wake = [&] {
        news.timer.cancel();
        if (news.writing && watching && hub.ends_at_once(*watching)) connection->socket.next_layer().cut();
    };
    const auto viewer = hub.watch(name, wake, options, Hub::Clock::now());
    if (!viewer) {
        co_await close(*connection, CloseCode::try_later, viewer.error().message);
        co_return;
    }
    watching = *viewer;
    const Leave leave([&hub, &viewer] { hub.leave(*viewer); });
    const auto receive_part = [&hub, number = *viewer](std::size_t bytes) {
        return hub.receive_part(number, bytes, Hub::Clock::now()).has_value();
    };
    // What is no text counts as one: it means nothing, but a flood of it is a flood.
    const auto receive = [&hub, number = *viewer](bool text, std::span<const std::uint8_t> message) {
        return hub.receive_text(number, text ? text_of(message) : R"({"type":"binary"})", Hub::Clock::now())
            .has_value();
    };
    const auto receive_nothing = [&hub, number = *viewer] {
        return hub.receive_nothing(number, Hub::Clock::now()).has_value();
    };
    net::co_spawn(connection->socket.get_executor(), read_messages(connection, receive_part, receive, receive_nothing),
                  net::detached);
    co_await write_messages(*connection, [&] { return hub.next(*viewer, Hub::Clock::now()); });
}

net::awaitable<void> refuse_socket(Line line, Request request, CloseCode code, std::string why) {
    const auto connection = std::make_shared<Connection>(std::move(line));
    if (co_await accepted(*connection, request, most_text_bytes)) co_await close(*connection, code, why);
}

net::awaitable<void> watch_by_body(Line& line, ResponseHeader header, std::string name, Hub& hub) {
    line.keep_kernel_buffers_small();
    News news(line.get_executor());
    std::optional<Hub::Viewer> watching;
    const auto wake = [&] {
        news.timer.cancel();
        if (news.writing && watching && hub.ends_at_once(*watching)) line.cut();
    };
    const auto viewer = hub.watch(name, wake, {.texts = false}, Hub::Clock::now());
    if (viewer) watching = *viewer;
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
    line.expires_after(silence);
    const auto [begun, header_bytes] = co_await http::async_write_header(line, serializer, awaited);
    if (!viewer || begun) co_return;
    for (;;) {
        const auto message = hub.next(*viewer, Hub::Clock::now());
        if (std::holds_alternative<Closing>(message)) break;
        const auto* packet = std::get_if<SharedPacket>(&message);
        if (!packet) {
            line.expires_never();
            co_await news.wait();
            continue;
        }
        line.expires_after(silence);
        const auto& bytes = (*packet)->bytes;
        news.writing = true;
        const auto [error, written] =
            co_await net::async_write(line, http::make_chunk(net::const_buffer(bytes.data(), bytes.size())), awaited);
        news.writing = false;
        if (error) co_return;
    }
    co_await net::async_write(line, http::make_chunk_last(), awaited);
}

}  // namespace htvm::live
