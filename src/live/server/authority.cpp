#include "live/server/authority.h"

#include <openssl/evp.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "core/letter_case.h"
#include "live/client/line.h"
#include "live/files/http_request.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace ssl = net::ssl;
using tcp = net::ip::tcp;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::chrono::seconds longest_held{3600};
constexpr std::size_t most_header_bytes = 8192;

// Tokens are not kept, so the hash of the question stands for it.
std::array<std::uint8_t, 32> hash_of(const std::string& text) {
    std::array<std::uint8_t, 32> out{};
    if (EVP_Digest(text.data(), text.size(), out.data(), nullptr, EVP_sha256(), nullptr) != 1) std::abort();
    return out;
}

// A name or an address, as certificates are for.
bool is_address(const std::string& host) {
    beast::error_code error;
    net::ip::make_address(host, error);
    return !error;
}

}  // namespace

std::chrono::seconds max_age(std::string_view cache_control) {
    const auto text = internal::lower_case(cache_control);
    std::chrono::seconds out{0};
    for (std::size_t begin = 0; begin < text.size();) {
        const auto end = std::min(text.find(',', begin), text.size());
        auto part = std::string_view(text).substr(begin, end - begin);
        while (part.starts_with(' ')) part.remove_prefix(1);
        while (part.ends_with(' ')) part.remove_suffix(1);
        if (part == "no-store" || part == "no-cache") return std::chrono::seconds(0);
        constexpr std::string_view name = "max-age=";
        const auto age = part.starts_with(name) ? whole_number(part.substr(name.size())) : std::nullopt;
        if (age)
            out = std::chrono::seconds(std::min<std::uint64_t>(*age, static_cast<std::uint64_t>(longest_held.count())));
        begin = end + 1;
    }
    return out;
}

Authority::Authority(AuthorityOptions options, HubAddress address)
    : options_(std::move(options)), address_(std::move(address)), tls_(ssl::context::tls_client) {
    SSL_CTX_set_min_proto_version(tls_.native_handle(), TLS1_2_VERSION);
    beast::error_code ignored;
    tls_.set_default_verify_paths(ignored);
    tls_.set_verify_mode(ssl::verify_peer, ignored);
}

Result<Authority> Authority::open(const AuthorityOptions& options) {
    auto address = parse_web_address(options.url);
    if (!address)
        return fail(ErrorKind::bad_input, "'" + options.url.substr(0, options.url.find('?')) +
                                              "' is no address of who says who may: http://HOST:PORT/PATH or https");
    return Authority(options, std::move(*address));
}

net::awaitable<Answer> Authority::ask(Question question) {
    const nlohmann::json json = {{"action", std::move(question.action)},
                                 {"stream", std::move(question.stream)},
                                 {"address", std::move(question.address)},
                                 {"token", std::move(question.token)}};
    // Tokens may be any bytes.
    const auto text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    const auto hash = hash_of(text);
    if (const auto found = known_.find(hash); found != known_.end() && Clock::now() < found->second.until) {
        ++counters_.remembered;
        co_return found->second.answer;
    }
    Reply reply;
    try {
        reply = co_await ask_in_turn(text);
    } catch (const std::exception&) {
        // For want of memory: no answer.
        reply = {};
    }
    ++(reply.answer == Answer::yes ? counters_.yes : reply.answer == Answer::no ? counters_.no : counters_.none);
    if (reply.answer != Answer::none && reply.holds.count() > 0) remember(hash, reply);
    co_return reply.answer;
}

void Authority::remember(const Hash& question, const Reply& reply) {
    const auto now = Clock::now();
    if (known_.size() >= options_.remembered)
        std::erase_if(known_, [now](const auto& one) { return one.second.until <= now; });
    if (known_.size() >= options_.remembered) known_.erase(known_.begin());  // as good as any: they are hashes
    known_[question] = {reply.answer, now + reply.holds};
}

// One of the questions that are on their way, however it ends.
struct Authority::Turn {
    Authority& its;
    explicit Turn(Authority& authority) : its(authority) { ++its.asking_; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() {
        --its.asking_;
        its.turn_->cancel_one();
    }
};

net::awaitable<Authority::Reply> Authority::ask_in_turn(const std::string& text) {
    const auto deadline = Clock::now() + options_.time;
    if (!turn_)
        turn_ = std::make_shared<net::steady_timer>(co_await net::this_coro::executor, Clock::time_point::max());
    if (asking_ >= options_.at_once) {
        if (waiting_ >= options_.waiting) co_return Reply{};
        ++waiting_;
        while (asking_ >= options_.at_once) co_await turn_->async_wait(awaited);
        --waiting_;
    }
    const Turn turn(*this);
    if (Clock::now() >= deadline) co_return Reply{};
    co_return co_await exchange(text, deadline);
}

net::awaitable<Authority::Reply> Authority::exchange(const std::string& text, Clock::time_point deadline) {
    ++counters_.asked;
    const auto executor = co_await net::this_coro::executor;
    const auto resolver = std::make_shared<tcp::resolver>(executor);
    net::steady_timer late(executor, deadline);
    late.async_wait([resolver](const beast::error_code& error) {
        if (!error) resolver->cancel();
    });
    const auto [unknown, places] =
        co_await resolver->async_resolve(address_.host, std::to_string(address_.port), awaited);
    late.cancel();
    if (unknown || Clock::now() >= deadline) co_return Reply{};
    beast::tcp_stream stream(executor);
    stream.expires_at(deadline);
    const auto [unreachable, place] = co_await stream.async_connect(places, awaited);
    if (unreachable) co_return Reply{};
    stream.expires_never();
    Line line(std::move(stream), address_.secure ? &tls_ : nullptr, executor);
    line.expires_after(deadline - Clock::now());
    if (auto* secure = line.secure()) {
        if (!is_address(address_.host)) SSL_set_tlsext_host_name(secure->native_handle(), address_.host.c_str());
        beast::error_code ignored;
        secure->set_verify_callback(ssl::host_name_verification(address_.host), ignored);
        if (co_await line.handshake(ssl::stream_base::client)) co_return Reply{};
    }
    constexpr unsigned version = 11;
    http::request<http::string_body> request(http::verb::post, address_.target, version, text);
    request.set(http::field::host, host_header(address_));
    request.set(http::field::user_agent, "htvm");
    request.set(http::field::content_type, "application/json");
    request.keep_alive(false);
    request.prepare_payload();
    const auto [unsent, written] = co_await http::async_write(line, request, awaited);
    if (unsent) co_return Reply{};
    // What it says besides is not read.
    beast::flat_buffer buffer(most_header_bytes);
    http::response_parser<http::empty_body> parser;
    parser.header_limit(most_header_bytes);
    const auto [unread, read] = co_await http::async_read_header(line, buffer, parser, awaited);
    if (unread) co_return Reply{};
    const auto& response = parser.get();
    const auto status = response.result();
    const auto answer = status == http::status::ok          ? Answer::yes
                        : status == http::status::forbidden ? Answer::no
                                                            : Answer::none;
    const auto holds = max_age(response[http::field::cache_control]);
    line.cut();
    co_return Reply{answer, holds};
}

}  // namespace htvm::live
