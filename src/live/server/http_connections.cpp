#include "live/server/http_connections.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "live/files/response_sending.h"

namespace htvm::live {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

namespace {

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t header_limit = 8192;

// Ends what waits on the line once it is late, but leaves the line as it is, so that an answer can say so.
class Deadline {
public:
    Deadline(Line& line, std::chrono::seconds time) : timer_(line.get_executor(), time) {
        timer_.async_wait([&line, state = state_](const beast::error_code& cancelled) {
            if (cancelled || !state->waits) return;
            state->late = true;
            line.cancel();
        });
    }
    Deadline(const Deadline&) = delete;
    Deadline& operator=(const Deadline&) = delete;
    ~Deadline() { state_->waits = false; }
    bool late() const { return state_->late; }

private:
    struct State {
        bool waits = true, late = false;
    };
    std::shared_ptr<State> state_ = std::make_shared<State>();
    net::steady_timer timer_;
};

bool is_of_http(const beast::error_code& error) {
    return error.category() == http::make_error_code(http::error::bad_method).category() &&
           error != http::error::end_of_stream;
}

std::string_view path_of(const Request& request) {
    const std::string_view target = request.target();
    return target.substr(0, target.find_first_of("?#"));
}

}  // namespace

net::awaitable<void> HttpConnections::serve(Line line, net::ip::address address) {
    line.expires_after(header_time_);
    auto client = Client(address);
    std::optional<AddressCounts::Place> place;
    const auto take_place = [&](const net::ip::address& of) {
        if (auto admitted = site_.admission.admit_behind_proxy(of)) place.emplace(std::move(*admitted));
    };
    if (site_.proxy_protocol && site_.proxies.trusts(address)) {
        const auto named = co_await read_proxy_header(line, address);
        if (!named) co_return closed("proxy_header");
        client = *named;
        if (client.by_proxy) take_place(client.address);
        if (client.by_proxy && !place) {
            site_.refusals.count("connections");
            co_return closed("connections");
        }
    }
    if (const auto insecure = co_await line.handshake(net::ssl::stream_base::server)) {
        if (insecure == beast::error::timeout) tell_too_slow(client.address);
        co_return closed("tls");
    }
    auto live = co_await answer_requests(line, client);
    if (!live) {
        co_await line.close();
        co_return;
    }
    if (!client.by_proxy) {
        client = site_.proxies.client_of(live->request, client);
        if (client.by_proxy) take_place(client.address);
    }
    const bool has_place = place || !client.by_proxy;
    co_await carry_live(std::move(line), std::move(*live), client, has_place);
}

// Whom the proxy connects, or the proxy itself; nothing if it does not say so as it should.
net::awaitable<std::optional<Client>> HttpConnections::read_proxy_header(Line& line, const net::ip::address& address) {
    Line::BelowTls below_tls(line);
    std::vector<std::uint8_t> bytes;
    for (;;) {
        const auto needed = proxy_header_needs(bytes);
        if (needed && *needed == 0) break;
        const auto had = bytes.size();
        if (needed) {
            bytes.resize(had + *needed);
            const auto [error, got] =
                co_await net::async_read(below_tls, net::buffer(bytes.data() + had, *needed), awaited);
            if (!error) continue;
        }
        site_.refusals.tell({"proxy_header", "the proxy does not begin with a header of the PROXY protocol"}, "",
                            address);
        co_return std::nullopt;
    }
    const auto named = live::read_proxy_header(bytes);
    if (named) co_return *named ? Client(**named, true) : Client(address);
    site_.refusals.tell({"proxy_header", named.error().message}, "", address);
    co_return std::nullopt;
}

net::awaitable<HttpConnections::RequestRead> HttpConnections::read_request(Line& line, beast::flat_buffer& buffer,
                                                                           const net::ip::address& address) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(header_limit);
    line.expires_never();
    beast::error_code failed;
    bool late = false;
    {
        const Deadline deadline(line, header_time_);
        idle_.insert(&line);
        const auto [error, bytes] = co_await http::async_read_header(line, buffer, parser, awaited);
        idle_.erase(&line);
        failed = error;
        late = deadline.late();
    }
    if (failed && late && parser.got_some()) {
        tell_too_slow(address);
        co_return RequestRead{.request = {}, .status = http::status::request_timeout, .why = "header_time"};
    }
    if (failed == http::error::header_limit || failed == http::error::buffer_overflow) {
        site_.refusals.tell({"request", "the request's header is too large"}, "", address);
        co_return RequestRead{
            .request = {}, .status = http::status::request_header_fields_too_large, .why = "bad_request"};
    }
    auto& request = parser.get();
    const auto hosts = failed ? 0 : request.count(http::field::host);
    // No request here has a body; one that does would be read as the next request.
    const bool wrong = !failed && (!parser.is_done() || hosts > 1 || (hosts == 0 && request.version() >= 11));
    if (is_of_http(failed) || wrong) {
        site_.refusals.tell({"request", "this is no request that is answered here"}, "", address);
        co_return RequestRead{.request = {}, .status = http::status::bad_request, .why = "bad_request"};
    }
    if (failed) co_return RequestRead{.request = {}, .why = late ? "idle" : draining_ ? "drained" : "left"};
    co_return RequestRead{.request = std::move(request)};
}

// Until the connection is of no further use, or a request is for a live stream: that one.
net::awaitable<std::optional<HttpConnections::LiveRequest>> HttpConnections::answer_requests(Line& line,
                                                                                             const Client& connected) {
    beast::flat_buffer buffer(header_limit);
    for (;;) {
        auto read = co_await read_request(line, buffer, connected.address);
        const auto since = std::chrono::steady_clock::now();
        if (!read.request) {
            closed(read.why);
            if (read.status == http::status::ok) break;
            auto response = empty_response(read.status, {});
            response.header.keep_alive(false);
            co_await send(line, response, false, site_.stall_time);
            break;
        }
        auto& request = *read.request;
        const auto client = site_.proxies.client_of(request, connected);
        auto route = route_of(request, site_.hub != nullptr);
        if (route.is_live() && site_.admission.host_allowed(request))
            co_return LiveRequest{std::move(request), std::move(route)};
        auto response = co_await answer(site_, route, request, client);
        site_.traffic.answer_time[name_of(route.handler)].add(std::chrono::steady_clock::now() - since);
        const bool alive = request.keep_alive() && !draining_;
        response.header.keep_alive(alive);
        const bool sent = co_await send(line, response, request.method() != http::verb::head, site_.stall_time);
        tell_access(request, client, response.header.result_int(), response.header[http::field::content_length], since);
        if (alive && sent) continue;
        closed(!sent ? "stalled" : draining_ ? "drained" : "done");
        break;
    }
    co_return std::nullopt;
}

net::awaitable<void> HttpConnections::carry_live(Line line, LiveRequest live, Client client, bool has_place) {
    const auto since = std::chrono::steady_clock::now();
    const auto request = site_.access ? live.request : Request();
    const bool socket = live.route.socket;
    co_await carry(site_, std::move(line), std::move(live.request), std::move(live.route), client, has_place);
    closed("live");
    constexpr unsigned switched = 101, whole = 200;
    if (site_.access) tell_access(request, client, socket ? switched : whole, "", since);
}

// What stands behind the path may be a token or a link, so it is left out.
void HttpConnections::tell_access(const Request& request, const Client& client, std::uint64_t status,
                                  std::string_view bytes, std::chrono::steady_clock::time_point since) const {
    if (!site_.access) return;
    const auto method = std::string(request.method_string()), path = std::string(path_of(request));
    const auto took =
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - since).count();
    const auto count = static_cast<std::int64_t>(whole_number(bytes).value_or(0));
    site_.access({.name = "request",
                  .text = method + ' ' + path + ' ' + std::to_string(status) + ' ' + std::to_string(count) + " bytes " +
                          std::to_string(took) + " us",
                  .address = client.address.to_string(),
                  .numbers = {{"status", static_cast<std::int64_t>(status)}, {"bytes", count}, {"microseconds", took}},
                  .words = {{"method", method}, {"path", path}}});
}

// One who has not sent a whole request in time, nor agreed on TLS.
void HttpConnections::tell_too_slow(const net::ip::address& address) {
    const auto seconds = std::to_string(header_time_.count());
    site_.refusals.tell({"header_time", "the request did not come whole within " + seconds + " seconds"}, "", address);
}

void HttpConnections::drain() {
    draining_ = true;
    for (auto* line : idle_) line->cancel();
}

}  // namespace htvm::live
