#include "live/client/http_client.h"

#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/vector_body.hpp>
#include <boost/beast/http/write.hpp>
#include <exception>
#include <optional>
#include <utility>

#include "live/client/hub_client.h"
#include "live/client/line.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = net::ip::tcp;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t most_header_bytes = 16384, buffer_bytes = 65536;
constexpr int most_redirects = 5;

using Parser = http::response_parser<http::vector_body<std::uint8_t>>;

bool is_ip_address(const std::string& host) {
    beast::error_code error;
    net::ip::make_address(host, error);
    return !error;
}

bool same_host(const HubAddress& a, const HubAddress& b) {
    return a.secure == b.secure && a.host == b.host && a.port == b.port;
}

tl::unexpected<Error> lost(const HubAddress& address, const std::string& why) {
    return fail(ErrorKind::corrupt_stream, shown_web(address) + " cannot be fetched: " + why);
}

bool is_redirect(unsigned status) {
    return status == 301 || status == 302 || status == 303 || status == 307 || status == 308;
}

}  // namespace

struct HttpClient::State {
    HttpClientOptions options;
    net::io_context context;
    ssl::context tls{ssl::context::tls_client};
    std::unique_ptr<Line> line;  // that stays; null: none
    HubAddress line_to;
    std::optional<HubAddress> first;  // that was asked for
    bool stopped = false;             // what was at work then stays in the context until it goes

    net::awaitable<Result<void>> connect(const HubAddress& address);
    net::awaitable<Result<HttpAnswer>> ask(const HubAddress& address, std::size_t most_bytes, bool& answered);
    net::awaitable<Result<HttpAnswer>> exchange(const HubAddress& address, std::size_t most_bytes);
    net::awaitable<void> watch(net::steady_timer& timer, const bool& done);
    Result<HttpAnswer> run(const HubAddress& address, std::size_t most_bytes);
};

net::awaitable<Result<void>> HttpClient::State::connect(const HubAddress& address) {
    line.reset();
    tcp::resolver resolver(context);
    net::steady_timer deadline(context, options.patience);
    deadline.async_wait([&resolver](const beast::error_code& error) {
        if (!error) resolver.cancel();
    });
    const auto [unknown, places] = co_await resolver.async_resolve(address.host, std::to_string(address.port), awaited);
    deadline.cancel();
    if (unknown) co_return lost(address, "the name is not found: " + unknown.message());
    beast::tcp_stream stream(context);
    stream.expires_after(options.patience);
    const auto [unreachable, place] = co_await stream.async_connect(places, awaited);
    if (unreachable) co_return lost(address, unreachable.message());
    stream.expires_never();
    line = address.secure ? std::make_unique<Line>(std::move(stream), tls) : std::make_unique<Line>(std::move(stream));
    line_to = address;
    auto* secure = line->secure();
    if (!secure) co_return Result<void>();
    if (!is_ip_address(address.host)) SSL_set_tlsext_host_name(secure->native_handle(), address.host.c_str());
    secure->set_verify_mode(options.insecure ? ssl::verify_none : ssl::verify_peer);
    if (!options.insecure) secure->set_verify_callback(ssl::host_name_verification(address.host));
    line->expires_after(options.patience);
    if (const auto error = co_await line->handshake(ssl::stream_base::client); error) {
        const auto verified = SSL_get_verify_result(secure->native_handle());
        line.reset();
        if (verified == X509_V_OK) co_return lost(address, "TLS: " + error.message());
        co_return lost(address, std::string("its certificate is not trusted: ") +
                                    X509_verify_cert_error_string(verified) +
                                    "; --ca names a file of those to trust, --insecure takes any");
    }
    co_return Result<void>();
}

// By the connection that is there. answered: whether anything came.
net::awaitable<Result<HttpAnswer>> HttpClient::State::ask(const HubAddress& address, std::size_t most_bytes,
                                                          bool& answered) {
    constexpr unsigned version = 11;
    http::request<http::empty_body> request(http::verb::get, address.target, version);
    request.set(http::field::host, host_header(address));
    request.set(http::field::user_agent, "htvm");
    request.set(http::field::accept, "*/*");
    if (!options.token.empty() && same_host(address, *first))
        request.set(http::field::authorization, "Bearer " + options.token);
    line->expires_after(options.patience);
    const auto [unsent, written] = co_await http::async_write(*line, request, awaited);
    if (unsent) co_return lost(address, unsent.message());
    beast::flat_buffer buffer(buffer_bytes);
    Parser parser;
    parser.header_limit(most_header_bytes);
    parser.body_limit(most_bytes);
    parser.eager(true);
    // Where nothing comes for too long it is over, however long all of it takes.
    while (!parser.is_done()) {
        line->expires_after(options.patience);
        const auto [error, bytes] = co_await http::async_read_some(*line, buffer, parser, awaited);
        answered = answered || bytes > 0;
        if (error == http::error::body_limit)
            co_return fail(ErrorKind::limit, shown_web(address) + " is larger than the " + std::to_string(most_bytes) +
                                                 " bytes that are taken of it");
        if (error == http::error::end_of_stream && !answered) co_return lost(address, "it closed the connection");
        if (error == http::error::partial_message || error == http::error::end_of_stream)
            co_return lost(address, "the connection ended before all of it had come");
        if (error == beast::error::timeout) co_return lost(address, "nothing came for too long");
        if (error) co_return lost(address, error.message());
    }
    auto response = parser.release();
    HttpAnswer out{.status = response.result_int(), .address = address};
    constexpr unsigned success = 200, other = 300;
    if (out.status >= success && out.status < other) {
        out.body = std::move(response.body());
    } else {
        const std::string_view text(reinterpret_cast<const char*>(response.body().data()), response.body().size());
        out.said = is_redirect(out.status) ? std::string(response[http::field::location])
                                           : printable(text.substr(0, std::min<std::size_t>(text.find('\n'), 200)));
        if (out.said.empty() || out.said.starts_with('<'))
            out.said = std::string(http::obsolete_reason(http::int_to_status(out.status)));
    }
    if (!response.keep_alive()) line.reset();
    co_return out;
}

net::awaitable<Result<HttpAnswer>> HttpClient::State::exchange(const HubAddress& address, std::size_t most_bytes) {
    for (bool again = true;;) {
        const bool stayed = line && same_host(line_to, address);
        if (!stayed)
            if (auto connected = co_await connect(address); !connected) co_return tl::unexpected(connected.error());
        bool answered = false;
        auto out = co_await ask(address, most_bytes, answered);
        if (out) co_return out;
        line.reset();
        // A server may close a connection that stayed whenever it likes.
        if (answered || !stayed || !std::exchange(again, false)) co_return out;
    }
}

net::awaitable<void> HttpClient::State::watch(net::steady_timer& timer, const bool& done) {
    constexpr std::chrono::milliseconds often{100};
    while (!done) {
        timer.expires_after(often);
        co_await timer.async_wait(awaited);
        if (done || !options.is_stopped()) continue;
        context.stop();
        co_return;
    }
}

Result<HttpAnswer> HttpClient::State::run(const HubAddress& address, std::size_t most_bytes) {
    if (stopped) return lost(address, "it was interrupted");
    std::optional<Result<HttpAnswer>> out;
    bool done = false;
    net::steady_timer timer(context);
    context.restart();
    net::co_spawn(context, exchange(address, most_bytes), [&](const std::exception_ptr& error, Result<HttpAnswer> got) {
        if (!error) out = std::move(got);
        done = true;
        timer.cancel();
    });
    if (options.is_stopped) net::co_spawn(context, watch(timer, done), [](const std::exception_ptr&) {});
    context.run();
    stopped = !done;
    if (out) return std::move(*out);
    return lost(address, stopped ? "it was interrupted" : "there is no memory for it");
}

HttpClient::HttpClient(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpClient::HttpClient(HttpClient&&) noexcept = default;
HttpClient& HttpClient::operator=(HttpClient&&) noexcept = default;
HttpClient::~HttpClient() = default;

Result<HttpClient> HttpClient::create(const HttpClientOptions& options) {
    auto state = std::make_unique<State>();
    state->options = options;
    SSL_CTX_set_min_proto_version(state->tls.native_handle(), TLS1_2_VERSION);
    beast::error_code error;
    if (options.certificates.empty())
        state->tls.set_default_verify_paths(error);
    else
        state->tls.load_verify_file(options.certificates, error);
    if (error && !options.certificates.empty())
        return fail(ErrorKind::bad_input, options.certificates + " cannot be read as PEM: " + error.message());
    return HttpClient(std::move(state));
}

Result<HttpAnswer> HttpClient::get(const HubAddress& address, std::size_t most_bytes) {
    auto& state = *state_;
    if (!state.first) state.first = address;
    auto place = address;
    for (int redirects = 0;; ++redirects) {
        auto answer = state.run(place, most_bytes);
        if (!answer || !is_redirect(answer->status)) return answer;
        if (redirects == most_redirects) return lost(address, "it is redirected again and again");
        auto next = resolved_reference(place, answer->said);
        if (!next) return lost(place, "it is redirected to what is no address");
        if (place.secure && !next->secure) return lost(place, "it is redirected to where there is no TLS");
        place = std::move(*next);
    }
}

}  // namespace htvm::live
