#include "live/server/server.h"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstring>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "live/client/control.h"
#include "live/client/line.h"
#include "live/server/handlers.h"
#include "live/server/http_connections.h"
#include "live/server/live_segments.h"
#include "live/server/recorder.h"
#include "live/server/refusals.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
using tcp = net::ip::tcp;

constexpr auto awaited = net::as_tuple(net::use_awaitable);

// For TLS 1.2 and 1.3, with the certificate chain and the private key of two PEM files; nothing if there is no
// certificate. bad_input if they cannot be read or do not belong together.
Result<std::optional<net::ssl::context>> read_certificate(const ServerOptions& options) {
    if (options.certificate.empty()) return std::nullopt;
    net::ssl::context context(net::ssl::context::tls_server);
    auto* native = context.native_handle();
    SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION);
    SSL_CTX_set_options(native, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
    SSL_CTX_set_mode(native, SSL_MODE_RELEASE_BUFFERS);  // of connections on which nothing is under way
    beast::error_code error;
    context.use_certificate_chain_file(options.certificate, error);
    if (error)
        return fail(ErrorKind::bad_input,
                    "no certificate can be read from " + options.certificate + ": " + error.message());
    context.use_private_key_file(options.private_key, net::ssl::context::pem, error);
    if (error)
        return fail(ErrorKind::bad_input,
                    "no key of that certificate can be read from " + options.private_key + ": " + error.message());
    // A key of another kind is read without complaint.
    if (SSL_CTX_check_private_key(native) != 1)
        return fail(ErrorKind::bad_input,
                    "the key in " + options.private_key + " is not that of the certificate in " + options.certificate);
    return std::optional(std::move(context));
}

// A socket that somebody else opened and listens on.
Result<void> take_over(tcp::acceptor& acceptor, int socket) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    int listens = 0;
    socklen_t listens_size = sizeof listens;
    const bool known = ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
                       ::getsockopt(socket, SOL_SOCKET, SO_ACCEPTCONN, &listens, &listens_size) == 0;
    beast::error_code error = net::error::invalid_argument;
    if (known && listens && (address.ss_family == AF_INET || address.ss_family == AF_INET6))
        acceptor.assign(address.ss_family == AF_INET ? tcp::v4() : tcp::v6(), socket, error);
    if (error) return fail(ErrorKind::bad_input, "the socket that was handed over listens to no TCP port");
    return {};
}

void choose_congestion_control(tcp::acceptor& acceptor, const std::string& name) {
    if (name.empty()) return;
    ::setsockopt(acceptor.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(),
                 static_cast<socklen_t>(name.size()));
}

Result<void> listen(tcp::acceptor& acceptor, const ServerOptions& options) {
    if (options.listening_socket >= 0) {
        auto taken = take_over(acceptor, options.listening_socket);
        if (taken) choose_congestion_control(acceptor, options.congestion_control);
        return taken;
    }
    beast::error_code error;
    const auto address = net::ip::make_address(options.address, error);
    if (error) return fail(ErrorKind::bad_input, options.address + " is not an IP address");
    const tcp::endpoint endpoint(address, options.port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
    using SharedPort = net::detail::socket_option::boolean<SOL_SOCKET, SO_REUSEPORT>;
    if (!error && options.share_port) acceptor.set_option(SharedPort(true), error);
    if (!error) acceptor.bind(endpoint, error);
    // Connections inherit it.
    if (!error) choose_congestion_control(acceptor, options.congestion_control);
    if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
    if (error)
        return fail(ErrorKind::bad_input, "cannot listen on " + options.address + " port " +
                                              std::to_string(options.port) + ": " + error.message());
    return {};
}

// Records what goes to the viewers of the hub's streams.
void record(Hub& hub, Recorder& recorder) {
    const auto sent = [&](const std::string& stream, const SharedPacket& packet, Hub::Clock::time_point now) {
        if (recorder.record(stream, packet, now, std::chrono::system_clock::now())) hub.ask_for_key_frame(stream, now);
    };
    hub.listen({.sent = sent, .ended = [&](const std::string& stream) { recorder.end(stream); }});
}

// Tells the log how many watch.
class ViewerReport {
public:
    // Nothing if nobody came or left since the last one.
    std::optional<Event> next(const Hub& hub) {
        std::size_t watching = 0;
        const auto streams = hub.streams(Hub::Clock::now());
        for (const auto& stream : streams) watching += stream.viewers;
        const auto joined = hub.counters().joined;
        const auto came = joined - joined_;
        if (came == 0 && watching == watching_) return std::nullopt;
        const auto left = watching_ + came - watching;
        joined_ = joined;
        watching_ = watching;
        const auto number = [](std::size_t value) { return static_cast<std::int64_t>(value); };
        return Event{.name = "viewers",
                     .text = std::to_string(watching) + " watch " + std::to_string(streams.size()) +
                             " streams; since the last time " + std::to_string(came) + " came and " +
                             std::to_string(left) + " left",
                     .numbers = {{"viewers", number(watching)},
                                 {"streams", number(streams.size())},
                                 {"came", number(came)},
                                 {"left", number(left)}}};
    }

private:
    std::size_t joined_ = 0, watching_ = 0;  // as the last one said
};

}  // namespace

// As Boost.Asio's, but what waits in it can be destroyed before it is.
struct Context : net::io_context {
    Context() : net::io_context(1) {}
    void destroy_what_waits() { shutdown(); }
};

// A thread that reads, encrypts and writes for connections.
struct LineThread {
    Context context;
    net::executor_work_guard<net::io_context::executor_type> work = net::make_work_guard(context);
    std::thread thread{};
    std::size_t lines = 0;  // that were given to it and have not ended; the server's thread counts
};

ServerOptions with_authority(ServerOptions options) {
    options.admission.authority = !options.authority.url.empty();
    return options;
}

// The lifecycle. What coroutines use comes before the context, which destroys those that have not ended.
struct Server::State {
    ServerOptions options;
    std::optional<net::ssl::context> tls;
    Refusals refusals{options.log};
    Admission admission{options.admission};
    Traffic traffic;
    Site site;
    HttpConnections connections{site, options.header_time};
    ViewerReport viewers;
    std::uint16_t port = 0;
    bool draining = false;
    std::vector<std::unique_ptr<LineThread>> line_threads;
    Context context;
    tcp::acceptor acceptor{context};
    std::optional<net::signal_set> hangup{};  // at which files are read again, where there are any
    std::optional<Authority> authority;       // if there is one
    std::optional<NatsPeering> nats;          // if the hub is joined with others
    SharedTexts texts{site, context.get_executor()};

    explicit State(const ServerOptions& given)
        : options(with_authority(given)),
          site{.admission = admission,
               .refusals = refusals,
               .traffic = traffic,
               .proxy_protocol = options.proxy_protocol,
               .access = options.access_log,
               .pages = player_pages(),
               .hub = options.hub,
               .recorder = options.recorder,
               .segments = options.segments,
               .stall_time = options.stall_time} {
        site.texts = &texts;
        for (unsigned i = 0; i < options.line_threads; ++i) line_threads.push_back(std::make_unique<LineThread>());
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    // Lines that wait on one side hold what belongs to the other, so both let go before either ends; and other threads
    // hand nothing over any more.
    ~State() {
        nats.reset();
        texts.walker.stop();
        texts.walker.join();
        context.destroy_what_waits();
        for (const auto& one : line_threads) one->context.destroy_what_waits();
    }

    Result<void> read_access_files();
    void tell(const Event& event) const {
        if (options.log) options.log(event);
    }
    bool shares_port() const { return options.share_port || options.listening_socket >= 0; }
    net::awaitable<void> accept();
    LineThread* calmest_line_thread() const;
    void take(tcp::socket socket, LineThread* thread);
    void take_waiting();
    net::awaitable<void> serve(Line line, net::ip::address address, AddressCounts::Place place, LineThread* thread);
    void run();
    net::awaitable<void> tick_hub();
    net::awaitable<void> each_second();
    net::awaitable<void> reload_on_hangup();
    net::awaitable<void> drain_on_signal();
};

// All that decides who may and by which certificate, or nothing of it.
Result<void> Server::State::read_access_files() {
    auto credentials = read_credentials(options.admission);
    if (!credentials) return tl::unexpected(credentials.error());
    auto certificate = read_certificate(options);
    if (!certificate) return tl::unexpected(certificate.error());
    admission.use(std::move(*credentials));
    tls = std::move(*certificate);
    return {};
}

// The one that has the fewest lines; null: there are none, and the server's own thread does what they would.
LineThread* Server::State::calmest_line_thread() const {
    const auto calmest = std::min_element(line_threads.begin(), line_threads.end(),
                                          [](const auto& a, const auto& b) { return a->lines < b->lines; });
    return calmest == line_threads.end() ? nullptr : calmest->get();
}

net::awaitable<void> Server::State::accept() {
    for (;;) {
        auto* thread = calmest_line_thread();
        auto [error, socket] = co_await acceptor.async_accept(
            thread ? net::any_io_executor(thread->context.get_executor()) : context.get_executor(), awaited);
        if (error == net::error::operation_aborted || !acceptor.is_open()) co_return;
        if (error) {
            // Out of file descriptors, most likely: others have to end first.
            net::steady_timer pause(context, std::chrono::milliseconds(100));
            co_await pause.async_wait(awaited);
            continue;
        }
        take(std::move(socket), thread);
    }
}

void Server::State::take(tcp::socket socket, LineThread* thread) {
    beast::error_code unknown;
    const auto address = socket.remote_endpoint(unknown).address();
    auto place = unknown ? std::nullopt : admission.admit_connection(address, site.proxies.trusts(address));
    if (!place) {
        refusals.count("connections");
        ++traffic.closed["connections"];
        constexpr std::string_view full =
            "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
        if (tls || unknown) return;
        socket.non_blocking(true, unknown);
        socket.write_some(net::buffer(full), unknown);
        socket.shutdown(tcp::socket::shutdown_send, unknown);
        return;
    }
    beast::tcp_stream tcp(std::move(socket));
    Line line(std::move(tcp), tls ? &*tls : nullptr, context.get_executor());
    net::co_spawn(context, serve(std::move(line), address, std::move(*place), thread), net::detached);
}

// The kernel would cut off those whom it has let wait for this socket.
void Server::State::take_waiting() {
    beast::error_code error;
    acceptor.non_blocking(true, error);
    while (!error) {
        auto* thread = calmest_line_thread();
        auto socket = acceptor.accept(
            thread ? net::any_io_executor(thread->context.get_executor()) : context.get_executor(), error);
        if (!error) take(std::move(socket), thread);
    }
}

net::awaitable<void> Server::State::serve(Line line, net::ip::address address, AddressCounts::Place place,
                                          LineThread* thread) {
    if (thread) ++thread->lines;
    {
        const auto counted = std::move(place);
        co_await connections.serve(std::move(line), address);
    }
    if (thread) --thread->lines;
    if (draining && admission.connections() == 0) context.stop();
}

net::awaitable<void> Server::State::tick_hub() {
    net::steady_timer timer(context);
    for (;;) {
        timer.expires_after(std::chrono::milliseconds(100));
        co_await timer.async_wait(awaited);
        traffic.late.add(std::chrono::steady_clock::now() - timer.expiry());
        options.hub->tick(Hub::Clock::now());
        if (options.segments) options.segments->tick(Hub::Clock::now());
        if (options.recorder)
            for (const auto& event : options.recorder->new_events()) tell(event);
    }
}

net::awaitable<void> Server::State::each_second() {
    constexpr int seconds_between_viewers = 60;
    int seconds_to_viewers = seconds_between_viewers;
    net::steady_timer timer(context);
    for (;;) {
        timer.expires_after(std::chrono::seconds(1));
        co_await timer.async_wait(awaited);
        refusals.end_second();
        if (options.hub && --seconds_to_viewers == 0) {
            seconds_to_viewers = seconds_between_viewers;
            if (const auto event = viewers.next(*options.hub)) tell(*event);
        }
    }
}

net::awaitable<void> Server::State::reload_on_hangup() {
    for (;;) {
        co_await hangup->async_wait(awaited);
        if (options.reload) options.reload();
        if (const auto read = read_access_files())
            tell({.name = "reloaded", .text = "certificate, publishers and keys were read again"});
        else
            tell({.name = "reload_failed",
                  .text = read.error().message + "; certificate, publishers and keys stay as they were",
                  .warning = true});
    }
}

net::awaitable<void> Server::State::drain_on_signal() {
    net::signal_set signals(context, SIGINT, SIGTERM);
    co_await signals.async_wait(awaited);
    draining = true;
    site.ending = true;
    beast::error_code ignored;
    if (shares_port()) {
        take_waiting();
        acceptor.close(ignored);
    }
    connections.drain();
    if (options.hub) options.hub->close_publishers(CloseCode::shut_down, "the hub shuts down");
    if (admission.connections() == 0) context.stop();
    // Publishers first: viewers shall find them where they go.
    net::steady_timer viewers_later(context, std::chrono::milliseconds(200));
    viewers_later.async_wait([this](const beast::error_code& cancelled) {
        if (!cancelled && options.hub) options.hub->close_all(CloseCode::shut_down, "the hub shuts down");
    });
    net::steady_timer timer(context, options.drain_time);
    timer.async_wait([this](const beast::error_code& cancelled) {
        if (!cancelled) context.stop();
    });
    co_await signals.async_wait(awaited);
    context.stop();
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::open(const ServerOptions& options) {
    auto state = std::make_unique<State>(options);
    if (auto read = state->read_access_files(); !read) return tl::unexpected(read.error());
    auto files = ServedFiles::open(options.folder, options.files);
    if (!files) return tl::unexpected(files.error());
    state->site.files = std::move(*files);
    auto proxies = TrustedProxies::read(options.trusted_proxies);
    if (!proxies) return tl::unexpected(proxies.error());
    state->site.proxies = std::move(*proxies);
    if (auto listening = listen(state->acceptor, options); !listening) return tl::unexpected(listening.error());
    state->port = state->acceptor.local_endpoint().port();
    state->admission.listens_on(state->port);
    if (options.hub && !options.nats.servers.empty()) {
        auto nats = NatsPeering::open(options.nats, *options.hub, state->context);
        if (!nats) return tl::unexpected(nats.error());
        state->site.nats = &state->nats.emplace(std::move(*nats));
    }
    if (!options.authority.url.empty()) {
        auto authority = Authority::open(options.authority);
        if (!authority) return tl::unexpected(authority.error());
        state->site.authority = &state->authority.emplace(std::move(*authority));
    }
    if (options.hub && options.recorder) record(*options.hub, *options.recorder);
    const auto& who = options.admission;
    // Before anybody knows that this server is there: without it, the signal ends the program.
    if (!options.certificate.empty() || !who.publishers.empty() || !who.link_keys.empty() ||
        !who.web_token_keys.empty() || !who.revoked.empty() || options.reload)
        state->hangup.emplace(state->context, SIGHUP);
    return Server(std::move(state));
}

std::uint16_t Server::port() const { return state_->port; }

std::string Server::congestion_control() const {
    std::array<char, 16> name{};  // TCP_CA_NAME_MAX of the kernel
    auto size = static_cast<socklen_t>(name.size());
    ::getsockopt(state_->acceptor.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(), &size);
    return {name.data(), ::strnlen(name.data(), name.size())};
}

void Server::run() { state_->run(); }

void Server::State::run() {
    net::co_spawn(context, accept(), net::detached);
    net::co_spawn(context, each_second(), net::detached);
    if (options.hub) net::co_spawn(context, tick_hub(), net::detached);
    net::co_spawn(context, drain_on_signal(), net::detached);
    if (hangup) net::co_spawn(context, reload_on_hangup(), net::detached);
    for (const auto& one : line_threads) one->thread = std::thread([&one] { one->context.run(); });
    context.run();
    for (const auto& one : line_threads) one->context.stop();
    for (const auto& one : line_threads) one->thread.join();
}

void Server::stop() { state_->context.stop(); }

}  // namespace htvm::live
