#include "live/server/http_connections.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <utility>

namespace htvm::live {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t header_limit = 8192;

net::awaitable<void> HttpConnections::serve(Line line, net::ip::address address) {
    line.next_layer().expires_after(header_time_);
    if (const auto insecure = co_await line.handshake(net::ssl::stream_base::server)) {
        if (insecure == beast::error::timeout) tell_too_slow(address);
        co_return;
    }
    if (auto live = co_await answer_requests(line, address))
        co_await carry(site_, std::move(line), std::move(live->request), std::move(live->route), address);
    else
        co_await line.close();
}

// Until the connection is of no further use, or a request is for a live stream: that one.
net::awaitable<std::optional<HttpConnections::LiveRequest>> HttpConnections::answer_requests(
    Line& line, const net::ip::address& address) {
    beast::flat_buffer buffer(header_limit);
    while (!draining_) {
        http::request_parser<http::empty_body> parser;
        parser.header_limit(header_limit);
        line.next_layer().expires_after(header_time_);
        idle_.insert(&line);
        const auto [error, bytes] = co_await http::async_read_header(line, buffer, parser, awaited);
        idle_.erase(&line);
        if (error == beast::error::timeout && parser.got_some()) tell_too_slow(address);
        if (error) break;
        // No request here has a body; one that does would be read as the next request.
        const bool body = !parser.is_done();
        auto& request = parser.get();
        Response response;
        const auto hosts = request.count(http::field::host);
        if (body || hosts > 1 || (hosts == 0 && request.version() >= 11)) {
            response.header.result(http::status::bad_request);
        } else {
            auto route = route_of(request, site_.hub != nullptr);
            if (route.is_live() && site_.admission.host_allowed(request))
                co_return LiveRequest{std::move(request), std::move(route)};
            response = co_await answer(site_, route, request, address);
        }
        const bool alive = request.keep_alive() && !body && !draining_;
        response.header.keep_alive(alive);
        const bool sent = co_await send(line, response, request.method() != http::verb::head, site_.stall_time);
        if (!alive || !sent) break;
    }
    co_return std::nullopt;
}

// One who has not sent a whole request in time, nor agreed on TLS.
void HttpConnections::tell_too_slow(const net::ip::address& address) {
    const auto seconds = std::to_string(header_time_.count());
    site_.refusals.tell({"header_time", "the request did not come whole within " + seconds + " seconds"}, "", address);
}

void HttpConnections::drain() {
    draining_ = true;
    for (auto* line : idle_) line->next_layer().cancel();
}

}  // namespace htvm::live
