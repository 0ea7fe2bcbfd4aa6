#include "live/files/local_server.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <chrono>
#include <csignal>
#include <utility>

#include "live/files/file_answers.h"
#include "live/files/response_sending.h"
#include "live/files/routing.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = net::ip::tcp;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t header_limit = 8192;
constexpr unsigned most_connections = 64;
constexpr std::chrono::seconds idle_time{60}, stall_time{30};

bool is_of_http(const beast::error_code& error) {
    return error.category() == http::make_error_code(http::error::bad_method).category() &&
           error != http::error::end_of_stream;
}

}  // namespace

struct LocalServer::State {
    ServedFiles files;
    PlayerPages pages = player_pages();
    unsigned connections = 0;
    std::uint16_t port = 0;
    net::io_context context{1};
    tcp::acceptor acceptor{context};

    Response answer(const Request& request) const;
    net::awaitable<void> serve(tcp::socket socket);
    net::awaitable<void> accept();
    net::awaitable<void> end_on_signal();
};

Response LocalServer::State::answer(const Request& request) const {
    auto header = common_header("same-origin");
    if (!names_loopback(request[http::field::host], port))
        return empty_response(http::status::misdirected_request, std::move(header));
    const auto route = route_of(request, false);
    switch (route.handler) {
        case Handler::wrong_method:
            return wrong_method_response(std::move(header));
        case Handler::bad_path:
            return bad_path_response(std::move(header));
        case Handler::page:
            return page_response(pages, "index.html", request, std::move(header));
        case Handler::player_file:
            return page_response(pages, route.name, request, std::move(header));
        case Handler::file:
            return file_response(files, route.path, request, std::move(header));
        case Handler::file_list:
            return text_response(file_list(files), "application/json", std::move(header));
        case Handler::stream_list:
            return text_response("null", "application/json", std::move(header));
        default:
            return empty_response(http::status::not_found, std::move(header));
    }
}

net::awaitable<void> LocalServer::State::serve(tcp::socket socket) {
    beast::tcp_stream stream(std::move(socket));
    beast::flat_buffer buffer(header_limit);
    for (bool alive = true; alive;) {
        http::request_parser<http::empty_body> parser;
        parser.header_limit(header_limit);
        stream.expires_after(idle_time);
        const auto [error, bytes] = co_await http::async_read_header(stream, buffer, parser, awaited);
        const auto& request = parser.get();
        // No request here has a body; one that does would be read as the next request.
        const bool wrong = error ? is_of_http(error) : !parser.is_done() || request.count(http::field::host) != 1;
        if (error && !wrong) break;
        auto response =
            wrong ? empty_response(http::status::bad_request, common_header("same-origin")) : answer(request);
        alive = !wrong && request.keep_alive();
        response.header.keep_alive(alive);
        alive = co_await send(stream, response, request.method() != http::verb::head, stall_time) && alive;
    }
    beast::error_code ignored;
    stream.socket().shutdown(tcp::socket::shutdown_send, ignored);
    --connections;
}

net::awaitable<void> LocalServer::State::accept() {
    for (;;) {
        auto [error, socket] = co_await acceptor.async_accept(awaited);
        if (error == net::error::operation_aborted) co_return;
        if (error || connections >= most_connections) {
            // Others have to end first.
            net::steady_timer pause(context, std::chrono::milliseconds(100));
            co_await pause.async_wait(awaited);
            continue;
        }
        ++connections;
        net::co_spawn(context, serve(std::move(socket)), net::detached);
    }
}

net::awaitable<void> LocalServer::State::end_on_signal() {
    net::signal_set signals(context, SIGINT, SIGTERM);
    co_await signals.async_wait(awaited);
    context.stop();
}

LocalServer::LocalServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
LocalServer::LocalServer(LocalServer&&) noexcept = default;
LocalServer& LocalServer::operator=(LocalServer&&) noexcept = default;
LocalServer::~LocalServer() = default;

Result<LocalServer> LocalServer::open(const LocalServerOptions& options) {
    auto state = std::make_unique<State>();
    auto files = ServedFiles::open(options.folder, options.files);
    if (!files) return tl::unexpected(files.error());
    state->files = std::move(*files);
    const tcp::endpoint endpoint(net::ip::address_v4::loopback(), options.port);
    auto& acceptor = state->acceptor;
    beast::error_code error;
    acceptor.open(endpoint.protocol(), error);
#ifndef _WIN32
    // There, it would let several programs listen on one port.
    if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
#endif
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
    if (error)
        return fail(ErrorKind::bad_input,
                    "cannot listen on 127.0.0.1 port " + std::to_string(options.port) + ": " + error.message());
    state->port = acceptor.local_endpoint().port();
    return LocalServer(std::move(state));
}

std::uint16_t LocalServer::port() const { return state_->port; }

void LocalServer::run() {
    net::co_spawn(state_->context, state_->accept(), net::detached);
    net::co_spawn(state_->context, state_->end_on_signal(), net::detached);
    state_->context.run();
}

void LocalServer::stop() { state_->context.stop(); }

}  // namespace htvm::live
