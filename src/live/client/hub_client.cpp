#include "live/client/hub_client.h"

#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "live/client/control.h"
#include "live/client/line.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Clock = std::chrono::steady_clock;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t most_texts = 64;  // that wait to be sent
constexpr std::size_t piece_bytes = 65536;
constexpr int receive_bytes = 262144;  // so that a hub notices a client that cannot follow
constexpr std::chrono::seconds heartbeat_interval{1};

bool is_ip_address(const std::string& host) {
    beast::error_code error;
    net::ip::make_address(host, error);
    return !error;
}

// ---- How it ended ---------------------------------------------------------------------------------------------------

HubEnding lost(std::string reason) { return {HubEnding::Kind::lost, false, std::move(reason)}; }

HubEnding by_close_code(const websocket::close_reason& close) {
    const auto reason = printable(std::string_view(close.reason.data(), close.reason.size()));
    const auto told = [&](const char* otherwise) { return reason.empty() ? otherwise : reason; };
    switch (static_cast<CloseCode>(close.code)) {
        case CloseCode::ended:
            return {HubEnding::Kind::ended, false, told("the stream has ended")};
        case CloseCode::refused:
            return {HubEnding::Kind::refused, true, told("the hub refuses it")};
        case CloseCode::too_large:
            return {HubEnding::Kind::refused, false, told("a packet is larger than the hub takes")};
        case CloseCode::continued:
            return {HubEnding::Kind::refused, false, told("this session was continued by another connection")};
        case CloseCode::taken_over:
            return {HubEnding::Kind::refused, false, told("another session took the stream over")};
        case CloseCode::shut_down:
            return lost(told("the hub shuts down"));
        case CloseCode::try_later:
            return lost(told("the hub asks to come again later"));
        default:
            return lost(told("the hub closed the connection"));
    }
}

HubEnding by_response(const websocket::response_type& response) {
    const auto status = response.result_int();
    auto said = printable(std::string_view(response.body()).substr(0, response.body().find('\n')));
    if (said.empty()) said = printable(http::obsolete_reason(http::int_to_status(status)));
    const auto reason = "it answers " + std::to_string(status) + ": " + said;
    constexpr unsigned client_errors = 400, server_errors = 500, too_many = 429;
    const bool for_good = status >= client_errors && status < server_errors && status != too_many;
    return {for_good ? HubEnding::Kind::refused : HubEnding::Kind::lost, false, reason};
}

HubEnding by_tls(Line& line, const beast::error_code& error) {
    const auto verified = SSL_get_verify_result(line.secure()->native_handle());
    if (verified == X509_V_OK) return lost("TLS: " + error.message() + "; a hub without TLS has an address with ws://");
    return {HubEnding::Kind::refused, false,
            std::string("its certificate is not trusted: ") + X509_verify_cert_error_string(verified) +
                "; --ca names a file of those to trust, --insecure takes any"};
}

// ---- One connection -------------------------------------------------------------------------------------------------

struct Connection {
    websocket::stream<Line> socket;
    net::steady_timer writes, reads;  // cancelled when there is something to write, or reading may go on
    net::steady_timer beats;
    std::deque<std::string> texts;
    Clock::time_point heard = Clock::now();
    bool reading = true;  // else silence means nothing
    bool finishing = false, closing = false, ended = false;
    std::optional<HubEnding> ending;  // where it is not what the socket says
    bool pinging = false;
    Clock::time_point pinged{};

    explicit Connection(Line line)
        : socket(std::move(line)),
          writes(socket.get_executor()),
          reads(socket.get_executor()),
          beats(socket.get_executor()) {}

    void wake() {
        writes.cancel();
        reads.cancel();
    }
    void end() {
        ended = true;
        wake();
        beats.cancel();
        socket.next_layer().cut();
    }
};
using SharedConnection = std::shared_ptr<Connection>;

net::awaitable<void> wait(net::steady_timer& timer) {
    timer.expires_at(Clock::time_point::max());
    co_await timer.async_wait(awaited);
}

// False if the line broke.
net::awaitable<bool> write_text(Connection& its, const std::string& text) {
    its.socket.text(true);
    const auto [error, bytes] = co_await its.socket.async_write(net::buffer(text), awaited);
    its.socket.binary(true);
    co_return !error;
}

}  // namespace

struct HubClient::State {
    HubClientOptions options;
    HubTalk talk;
    HubList hubs;
    ssl::context tls{ssl::context::tls_client};
    bool finishing = false;
    std::string last_words;                        // before it finishes
    std::optional<Clock::time_point> stood_since;  // the last connection; none: there was none
    mutable std::mutex mutex;
    HubClientStatus status;  // guarded by the mutex
    std::thread thread;
    net::io_context context{1};  // destroyed first: what runs in it refers to the rest
    SharedConnection connection;
    net::steady_timer pause{context};

    State(std::vector<HubAddress> addresses, const HubClientOptions& given, HubTalk its)
        : options(given), talk(std::move(its)), hubs(std::move(addresses)) {}
    ~State() { stop(); }

    void stop() {
        context.stop();
        if (thread.joinable()) thread.join();
    }
    net::awaitable<void> stay_connected();
    net::awaitable<HubEnding> connect_and_talk();
    net::awaitable<std::optional<HubEnding>> connect(const HubAddress& address);
    net::awaitable<HubEnding> read(SharedConnection its);
    net::awaitable<void> write(SharedConnection its);
    net::awaitable<void> beat(SharedConnection its);
    net::awaitable<void> ping(SharedConnection its);
    void came(Connection& its, beast::flat_buffer& buffer);
};

// Nothing if there is a connection now.
net::awaitable<std::optional<HubEnding>> HubClient::State::connect(const HubAddress& address) {
    tcp::resolver resolver(context);
    net::steady_timer deadline(context, options.handshake);
    deadline.async_wait([&resolver](const beast::error_code& error) {
        if (!error) resolver.cancel();
    });
    const auto [unknown, places] = co_await resolver.async_resolve(address.host, std::to_string(address.port), awaited);
    deadline.cancel();
    if (unknown) co_return lost("the name is not found: " + unknown.message());
    beast::tcp_stream tcp_stream(context);
    tcp_stream.expires_after(options.handshake);
    const auto [unreachable, place] = co_await tcp_stream.async_connect(places, awaited);
    if (unreachable) co_return lost(unreachable.message());
    beast::error_code ignored;
    tcp_stream.socket().set_option(net::socket_base::receive_buffer_size(receive_bytes), ignored);
    auto line = address.secure ? Line(std::move(tcp_stream), tls) : Line(std::move(tcp_stream));
    if (auto* secure = line.secure()) {
        if (!is_ip_address(address.host)) SSL_set_tlsext_host_name(secure->native_handle(), address.host.c_str());
        secure->set_verify_mode(options.insecure ? ssl::verify_none : ssl::verify_peer);
        if (!options.insecure) secure->set_verify_callback(ssl::host_name_verification(address.host));
        line.expires_after(options.handshake);
        if (const auto error = co_await line.handshake(ssl::stream_base::client); error) co_return by_tls(line, error);
    }
    line.expires_never();
    line.keep_kernel_buffers_small();
    auto its = std::make_shared<Connection>(std::move(line));
    auto& socket = its->socket;
    socket.set_option(websocket::stream_base::timeout{options.handshake, websocket::stream_base::none(), false});
    socket.set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
        request.set(http::field::sec_websocket_protocol, live_protocol);
        request.set(http::field::user_agent, "htvm");
        if (!options.token.empty()) request.set(http::field::authorization, "Bearer " + options.token);
    }));
    socket.read_message_max(options.largest_message);
    socket.auto_fragment(false);
    websocket::response_type response;
    const auto [refused] = co_await socket.async_handshake(response, host_header(address), address.target, awaited);
    if (refused == websocket::error::upgrade_declined) co_return by_response(response);
    if (refused)
        co_return lost("it does not speak WebSocket: " + refused.message() +
                       (address.secure ? "" : "; a hub with TLS has an address with wss://"));
    if (response[http::field::sec_websocket_protocol] != live_protocol)
        co_return HubEnding{HubEnding::Kind::refused, false, "it is no hub: it does not speak htvm.1"};
    socket.binary(true);
    connection = std::move(its);
    co_return std::nullopt;
}

// A message is complete.
void HubClient::State::came(Connection& its, beast::flat_buffer& buffer) {
    const auto* bytes = static_cast<const std::uint8_t*>(buffer.cdata().data());
    const auto count = buffer.size();
    if (its.socket.got_binary()) {
        if (talk.receive_packet) talk.receive_packet({bytes, bytes + count});
    } else if (talk.receive_text && count <= most_text_bytes) {
        talk.receive_text({reinterpret_cast<const char*>(bytes), count});
    }
    buffer.consume(count);
}

net::awaitable<HubEnding> HubClient::State::read(SharedConnection its) {
    beast::flat_buffer buffer(options.largest_message + 1);
    its->socket.control_callback([this, raw = its.get()](websocket::frame_type kind, beast::string_view) {
        raw->heard = Clock::now();
        if (kind != websocket::frame_type::pong || !raw->pinging) return;
        raw->pinging = false;
        const std::lock_guard lock(mutex);
        status.round_trip = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - raw->pinged);
    });
    while (!its->ended) {
        if (talk.may_read && !talk.may_read()) {
            its->reading = false;
            co_await wait(its->reads);
            its->reading = true;
            its->heard = Clock::now();
            continue;
        }
        const auto [error, bytes] = co_await its->socket.async_read_some(buffer, piece_bytes, awaited);
        if (its->ending) co_return *its->ending;
        if (error == websocket::error::closed) co_return by_close_code(its->socket.reason());
        if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow)
            co_return lost("it sent a message larger than is taken");
        if (error) co_return lost("the line broke: " + error.message());
        its->heard = Clock::now();
        if (its->socket.is_message_done()) came(*its, buffer);
    }
    co_return lost("the line broke");
}

net::awaitable<void> HubClient::State::write(SharedConnection its) {
    auto& socket = its->socket;
    while (!its->ended) {
        if (!its->texts.empty()) {
            const auto text = std::move(its->texts.front());
            its->texts.pop_front();
            if (!co_await write_text(*its, text)) break;
            continue;
        }
        if (const auto packet = talk.next ? talk.next() : nullptr) {
            const auto before = talk.before ? talk.before(*packet) : std::string();
            if (!before.empty() && !co_await write_text(*its, before)) break;
            const auto [error, bytes] = co_await socket.async_write(net::buffer(packet->bytes), awaited);
            if (error) break;
            continue;
        }
        if (its->finishing) {
            if (!last_words.empty() && !co_await write_text(*its, last_words)) break;
            its->closing = true;
            co_await socket.async_close(websocket::close_code::normal, awaited);
            break;
        }
        co_await wait(its->writes);
    }
}

// The round trip; and an answer from hubs that have nothing else to say.
net::awaitable<void> HubClient::State::ping(SharedConnection its) {
    its->pinging = true;
    its->pinged = Clock::now();
    co_await its->socket.async_ping({}, awaited);
}

net::awaitable<void> HubClient::State::beat(SharedConnection its) {
    while (!its->ended) {
        its->beats.expires_after(heartbeat_interval);
        co_await its->beats.async_wait(awaited);
        if (its->ended) co_return;
        if (its->reading && Clock::now() - its->heard > options.silence) {
            its->ending =
                lost("nothing was heard of it for " + std::to_string(options.silence.count() / 1000) + " seconds");
            its->end();
            co_return;
        }
        if (auto text = talk.heartbeat ? talk.heartbeat() : std::string(); !text.empty()) {
            if (its->texts.size() < most_texts) its->texts.push_back(std::move(text));
            its->writes.cancel();
        }
        if (!its->pinging) net::co_spawn(context, ping(its), net::detached);
    }
}

net::awaitable<HubEnding> HubClient::State::connect_and_talk() {
    if (auto failed = co_await connect(hubs.current())) co_return *failed;
    const auto its = connection;
    its->finishing = finishing;
    {
        const std::lock_guard lock(mutex);
        status.connected = true;
        status.hub = shown(hubs.current());
        status.round_trip.reset();
        ++status.connections;
    }
    stood_since = Clock::now();
    if (talk.connected) talk.connected();
    net::co_spawn(context, write(its), net::detached);
    net::co_spawn(context, beat(its), net::detached);
    const auto ending = co_await read(its);
    its->end();
    connection.reset();
    const std::lock_guard lock(mutex);
    status.connected = false;
    if (its->closing) co_return HubEnding{HubEnding::Kind::ended, false, "the stream has ended"};
    co_return ending;
}

net::awaitable<void> HubClient::State::stay_connected() {
    auto held_until = Clock::now();  // the last time that a connection stood for some time
    for (;;) {
        stood_since.reset();
        auto ending = co_await connect_and_talk();
        const auto now = Clock::now();
        if (stood_since && now - *stood_since >= options.silence) {
            hubs.held();
            held_until = now;
        }
        ending.reason = shown(hubs.current()) + ": " + ending.reason;
        if (ending.kind == HubEnding::Kind::refused && ending.for_now && now - held_until < options.patience)
            ending.kind = HubEnding::Kind::lost;
        if (ending.kind != HubEnding::Kind::lost) {
            talk.ended(ending);
            co_return;
        }
        if (talk.lost) talk.lost(ending);
        pause.expires_after(hubs.next());
        co_await pause.async_wait(awaited);
    }
}

// ---- HubClient ------------------------------------------------------------------------------------------------------

HubClient::HubClient(std::unique_ptr<State> state) : state_(std::move(state)) {}
HubClient::HubClient(HubClient&&) noexcept = default;
HubClient& HubClient::operator=(HubClient&&) noexcept = default;
HubClient::~HubClient() = default;

Result<HubClient> HubClient::create(std::vector<HubAddress> hubs, const HubClientOptions& options, HubTalk talk) {
    if (hubs.empty()) return fail(ErrorKind::bad_input, "there is no address of a hub");
    const bool by_tls = std::any_of(hubs.begin(), hubs.end(), [](const auto& hub) { return hub.secure; });
    auto state = std::make_unique<State>(std::move(hubs), options, std::move(talk));
    state->status.hub = shown(state->hubs.current());
    SSL_CTX_set_min_proto_version(state->tls.native_handle(), TLS1_2_VERSION);
    beast::error_code error;
    if (!options.certificates.empty())
        state->tls.load_verify_file(options.certificates, error);
    else if (by_tls)
        state->tls.set_default_verify_paths(error);
    if (error)
        return fail(ErrorKind::bad_input,
                    (options.certificates.empty() ? "the system's certificates" : options.certificates) +
                        " cannot be read as PEM: " + error.message());
    return HubClient(std::move(state));
}

void HubClient::start() {
    auto& state = *state_;
    net::co_spawn(state.context, state.stay_connected(), [&state](const std::exception_ptr& error) {
        if (error) state.talk.ended({HubEnding::Kind::refused, false, "out of memory"});
    });
    state.thread = std::thread([&state] { state.context.run(); });
}

void HubClient::wake() {
    net::post(state_->context, [state = state_.get()] {
        if (state->connection) state->connection->wake();
    });
}

void HubClient::say(std::string text) {
    auto* connection = state_->connection.get();
    if (!connection || connection->texts.size() >= most_texts) return;
    connection->texts.push_back(std::move(text));
    connection->writes.cancel();
}

void HubClient::learn(const std::vector<std::string>& hubs) { state_->hubs.learn(hubs); }

void HubClient::finish(std::string last_words) {
    net::post(state_->context, [state = state_.get(), words = std::move(last_words)]() mutable {
        state->finishing = true;
        state->last_words = std::move(words);
        state->pause.cancel();
        if (!state->connection) return;
        state->connection->finishing = true;
        state->connection->wake();
    });
}

void HubClient::stop() { state_->stop(); }

HubClientStatus HubClient::status() const {
    const std::lock_guard lock(state_->mutex);
    return state_->status;
}

std::string printable(std::string_view text) {
    constexpr std::size_t longest = 200;
    std::string out;
    for (const char c : text.substr(0, longest))
        if (static_cast<unsigned char>(c) >= 32 && c != 127) out += c;
    return out;
}

}  // namespace htvm::live
