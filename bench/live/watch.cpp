// Many viewers of one live stream in one process, for measurements: bench/live/load.py and lossy_line.py run it. They
// take what a hub sends as WebSockets, decode nothing, and note when each packet came. bench/live/publish.py writes the
// time of sending into each packet's timestamp (CLOCK_MONOTONIC, which all processes of a machine share, in other
// network namespaces too), so the delay is known without any other message. bench/live/arrivals.py reads what is noted.
// A viewer who loses its hub goes to another one by the rule of all clients (docs/live.md, section 2), if asked to.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/ssl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/dependency.hpp"
#include "htvm/packet.hpp"
#include "live/client/control.h"
#include "live/client/hub_list.h"

namespace htvm::live_bench {
namespace {

struct Options {
    std::string stream = "person", host = "127.0.0.1", source = "127.1.0.1", output;
    std::uint16_t port = 8080;
    unsigned viewers = 1, per_source = 32, slow = 0;
    double seconds = 10, joins_per_second = 400, watch_seconds = 0, slow_bits = 533000;
    bool tls = false, follow = false;
};

// What one arrival is noted as; arrivals.py has the same fields.
struct Arrival {
    std::int64_t arrived;  // microseconds by CLOCK_MONOTONIC
    std::int64_t sent;     // by the publisher; 0 for what is no packet
    std::uint32_t viewer;
    std::uint32_t frame;  // of `closed`: the reason, as a WebSocket's code; of `connecting`: the hub's port
    std::uint32_t bytes;
    std::uint8_t kind;         // a PacketKind, or one of these:
    std::uint8_t lacking = 0;  // 1: a frame that what came over this connection is not enough to decode (if `follow`)
    std::uint8_t unused[2] = {};
    static constexpr std::uint8_t connecting = 200, closed = 201;
};
static_assert(sizeof(Arrival) == 32);

std::int64_t microseconds_now() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000;
}

// Opcodes of RFC 6455, section 5.2.
constexpr std::uint8_t text_message = 1, binary_message = 2, close_message = 8, ping_message = 9, pong_message = 10;

// A message of which the beginning is kept: of packets the header, of others all that may be needed.
struct Message {
    std::uint8_t opcode = 0;
    std::size_t bytes = 0;
    std::vector<std::uint8_t> begin{};
    void add(std::span<const std::uint8_t> piece) {
        const auto most = opcode == binary_message ? packet_header_bytes : live::most_text_bytes;
        if (begin.size() < most)
            begin.insert(begin.end(), piece.begin(),
                         piece.begin() + static_cast<std::ptrdiff_t>(std::min(piece.size(), most - begin.size())));
        bytes += piece.size();
    }
    void clear() {
        bytes = 0;
        begin.clear();
    }
};

// Cuts what a server sends into messages (its frames are not masked).
class MessageReader {
public:
    // Calls take(message) for each message that ends in these bytes.
    template <typename Take>
    void push(std::span<const std::uint8_t> bytes, Take take) {
        while (!bytes.empty()) {
            if (!in_payload_) {
                header_[header_bytes_++] = bytes.front();
                bytes = bytes.subspan(1);
                if (!header_is_whole()) continue;
                begin_payload();
            }
            const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size()));
            message().add(bytes.first(count));
            bytes = bytes.subspan(count);
            left_ -= count;
            if (left_ > 0) continue;
            if (final_) {
                take(message());
                message().clear();
            }
            in_payload_ = false;
            header_bytes_ = 0;
        }
    }

private:
    static constexpr std::uint8_t least_control = 8;
    std::size_t length_bytes() const {
        const int length = header_[1] & 127;
        return length == 126 ? 2 : length == 127 ? 8 : 0;
    }
    bool header_is_whole() const { return header_bytes_ >= 2 && header_bytes_ == 2 + length_bytes(); }
    void begin_payload() {
        in_payload_ = true;
        final_ = (header_[0] & 128) != 0;
        control_ = (header_[0] & 15) >= least_control;
        left_ = length_bytes() == 0 ? header_[1] & 127 : 0;
        for (std::size_t i = 0; i < length_bytes(); ++i) left_ = left_ << 8 | header_[2 + i];
        if (const std::uint8_t opcode = header_[0] & 15; opcode != 0) message().opcode = opcode;
    }
    // Control messages may come between the frames of another.
    Message& message() { return control_ ? control_message_ : data_message_; }

    std::array<std::uint8_t, 10> header_{};
    std::size_t header_bytes_ = 0;
    bool in_payload_ = false, final_ = false, control_ = false;
    std::uint64_t left_ = 0;
    Message data_message_, control_message_;
};

struct FreeTls {
    void operator()(SSL* tls) const { SSL_free(tls); }
    void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
};

struct Viewer {
    std::uint32_t number = 0;
    live::HubList hubs;
    int socket = -1;
    std::unique_ptr<SSL, FreeTls> tls{};
    bool slow = false;
    bool asked = false, accepted = false;  // the HTTP request was sent, and answered
    std::size_t line_ends = 0;             // of the answer's end, "\r\n\r\n", so many bytes came
    std::int64_t since = 0;                // when it began to connect,
    std::int64_t stood_since = 0;          // and when it was connected
    std::int64_t heard = 0;
    std::optional<std::int64_t> comes_again{};  // when it connects to the next hub
    Dependencies dependencies{};                // of what came over this connection
    MessageReader reader{};
};

class Viewers {
public:
    explicit Viewers(const Options& options) : options_(options), buffer_(std::size_t{1} << 18) {}

    bool run() {
        epoll_ = ::epoll_create1(0);
        output_ = std::fopen(options_.output.c_str(), "wb");
        if (epoll_ < 0 || !output_) return fail(options_.output);
        if (options_.tls) {
            tls_.reset(SSL_CTX_new(TLS_client_method()));
            SSL_CTX_set_mode(tls_.get(), SSL_MODE_RELEASE_BUFFERS);
        }
        const auto first = live::parse_hub_address(fmt::format("{}://{}:{}/watch/{}", options_.tls ? "wss" : "ws",
                                                               options_.host, options_.port, options_.stream));
        if (!first) {
            fmt::print(stderr, "live_watch: {}\n", first.error().message);
            return false;
        }
        for (unsigned i = 0; i < options_.viewers; ++i) {
            viewers_.push_back(std::make_unique<Viewer>(Viewer{.number = i, .hubs = live::HubList({*first})}));
            viewers_.back()->slow = i < options_.slow;
        }
        const auto begin = microseconds_now();
        const auto end = begin + static_cast<std::int64_t>(options_.seconds * 1e6);
        std::size_t joined = 0;
        auto ticked = begin;
        std::vector<epoll_event> events(512);
        for (auto now = begin; now < end; now = microseconds_now()) {
            const double due = static_cast<double>(now - begin) * 1e-6 * options_.joins_per_second;
            for (; joined < viewers_.size() && static_cast<double>(joined) <= due; ++joined)
                if (!connect(*viewers_[joined])) return false;
            for (auto& viewer : viewers_)
                if (viewer->comes_again && now >= *viewer->comes_again && !connect(*viewer)) return false;
            if (now - ticked >= tick_us) {
                tick(now, static_cast<double>(now - ticked) * 1e-6);
                ticked = now;
            }
            // Sleeping between two looks rather than waiting for events: else the hub, on the same machine, would wake
            // this process at every write, which took a fourth of its time.
            const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
            for (int i = 0; i < count; ++i)
                hear(*static_cast<Viewer*>(events[static_cast<std::size_t>(i)].data.ptr), buffer_.size());
            if (count < static_cast<int>(events.size())) ::usleep(pause_us);
        }
        return std::fclose(output_) == 0;
    }

private:
    static constexpr std::int64_t tick_us = 50000, pause_us = 1000;
    static constexpr std::int64_t silence_us = 3000000, handshake_us = 5000000;  // as in live/client/hub_client.h

    static bool fail(const std::string& what) {
        fmt::print(stderr, "live_watch: {}: {}\n", what, std::strerror(errno));
        return false;
    }
    void note(const Arrival& arrival) { std::fwrite(&arrival, sizeof arrival, 1, output_); }
    void wait_for(Viewer& viewer, std::uint32_t events) {
        epoll_event event{};
        event.events = events;
        event.data.ptr = &viewer;
        ::epoll_ctl(epoll_, EPOLL_CTL_MOD, viewer.socket, &event);
    }

    bool connect(Viewer& viewer) {
        const auto& address = viewer.hubs.current();
        viewer.socket = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (viewer.socket < 0) return fail("socket");
        viewer.since = viewer.heard = microseconds_now();
        viewer.comes_again.reset();
        viewer.reader = {};
        viewer.dependencies = Dependencies();
        viewer.asked = viewer.accepted = false;
        viewer.line_ends = 0;
        constexpr int yes = 1, small = 16384;
        ::setsockopt(viewer.socket, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &yes, sizeof yes);
        if (viewer.slow) ::setsockopt(viewer.socket, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        sockaddr_in source{}, hub{};
        source.sin_family = hub.sin_family = AF_INET;
        hub.sin_port = htons(address.port);
        ::inet_pton(AF_INET, options_.source.c_str(), &source.sin_addr);
        ::inet_pton(AF_INET, address.host.c_str(), &hub.sin_addr);
        source.sin_addr.s_addr = htonl(ntohl(source.sin_addr.s_addr) + viewer.number / options_.per_source);
        if (::bind(viewer.socket, reinterpret_cast<const sockaddr*>(&source), sizeof source) != 0)
            return fail("bind " + options_.source);
        if (::connect(viewer.socket, reinterpret_cast<const sockaddr*>(&hub), sizeof hub) != 0 && errno != EINPROGRESS)
            return fail("connect " + address.host);
        if (tls_) {
            viewer.tls.reset(SSL_new(tls_.get()));
            SSL_set_fd(viewer.tls.get(), viewer.socket);
        }
        epoll_event event{};
        event.events = EPOLLOUT;
        event.data.ptr = &viewer;
        ::epoll_ctl(epoll_, EPOLL_CTL_ADD, viewer.socket, &event);
        note({.arrived = viewer.since,
              .sent = 0,
              .viewer = viewer.number,
              .frame = address.port,
              .bytes = 0,
              .kind = Arrival::connecting});
        return true;
    }

    // What is written is a few bytes on a line that is not full: it goes at once or the line is lost.
    static bool write(Viewer& viewer, std::string_view bytes) {
        if (viewer.tls) return SSL_write(viewer.tls.get(), bytes.data(), static_cast<int>(bytes.size())) > 0;
        return ::send(viewer.socket, bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0;
    }

    // Reads into the buffer; how many bytes; 0: there are none yet; nothing: the line is lost.
    std::optional<std::size_t> read(Viewer& viewer, std::size_t most) {
        if (viewer.tls) {
            std::size_t count = 0;
            while (count < most) {
                const int more = SSL_read(viewer.tls.get(), buffer_.data() + count, static_cast<int>(most - count));
                if (more > 0)
                    count += static_cast<std::size_t>(more);
                else if (SSL_get_error(viewer.tls.get(), more) == SSL_ERROR_WANT_READ || count > 0)
                    return count;
                else
                    return std::nullopt;
            }
            return count;
        }
        const auto count = ::recv(viewer.socket, buffer_.data(), most, 0);
        if (count > 0) return static_cast<std::size_t>(count);
        return count < 0 && errno == EAGAIN ? std::optional<std::size_t>(0) : std::nullopt;
    }

    // The line stands: agrees on keys, and asks for the stream.
    void ask(Viewer& viewer) {
        if (viewer.tls) {
            const int done = SSL_connect(viewer.tls.get());
            if (done <= 0) {
                const int why = SSL_get_error(viewer.tls.get(), done);
                if (why != SSL_ERROR_WANT_READ && why != SSL_ERROR_WANT_WRITE) return close(viewer, 0);
                return wait_for(viewer, why == SSL_ERROR_WANT_READ ? EPOLLIN : EPOLLOUT);
            }
        }
        const auto& address = viewer.hubs.current();
        const auto request = fmt::format(
            "GET {} HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: aHR2bSBsaXZlIGJlbmNoIQ==\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: {}\r\n\r\n",
            address.target, live::host_header(address), live::live_protocol);
        if (!write(viewer, request)) return close(viewer, 0);
        viewer.asked = true;
        wait_for(viewer, EPOLLIN);
    }

    // Reads at most so many bytes of what came.
    void hear(Viewer& viewer, std::size_t most) {
        if (viewer.socket < 0) return;
        if (!viewer.asked) return ask(viewer);
        if (viewer.slow && viewer.accepted && most == buffer_.size()) {
            ::epoll_ctl(epoll_, EPOLL_CTL_DEL, viewer.socket, nullptr);  // tick() reads from now on
            return;
        }
        const auto count = read(viewer, most);
        if (!count) return close(viewer, 0);
        std::span<const std::uint8_t> bytes(buffer_.data(), *count);
        const auto now = microseconds_now();
        if (!bytes.empty()) viewer.heard = now;
        while (!viewer.accepted && !bytes.empty()) {
            constexpr std::array<std::uint8_t, 4> ending = {'\r', '\n', '\r', '\n'};
            viewer.line_ends = bytes.front() == ending[viewer.line_ends] ? viewer.line_ends + 1 : bytes.front() == '\r';
            viewer.accepted = viewer.line_ends == ending.size();
            viewer.stood_since = now;
            bytes = bytes.subspan(1);
        }
        viewer.reader.push(bytes, [&](const Message& message) { take(viewer, message, now); });
    }

    void take(Viewer& viewer, const Message& message, std::int64_t now) {
        if (viewer.socket < 0) return;
        if (message.opcode == close_message)
            return close(viewer, message.bytes < 2 ? 0 : message.begin[0] << 8 | message.begin[1]);
        if (message.opcode == ping_message) {
            constexpr std::array<char, 6> pong = {static_cast<char>(128 | pong_message), static_cast<char>(128)};
            write(viewer, {pong.data(), pong.size()});
        }
        if (message.opcode == text_message && options_.follow) {
            const auto text =
                live::read_to_viewer({reinterpret_cast<const char*>(message.begin.data()), message.begin.size()});
            if (const auto* hello = text ? std::get_if<live::Hello>(&*text) : nullptr) viewer.hubs.learn(hello->hubs);
        }
        if (message.opcode != binary_message) return;
        std::uint32_t payload_bytes = 0;
        const auto header = read_packet_header(message.begin, payload_bytes);
        if (!header) return;
        if (options_.follow) viewer.dependencies.push(*header);
        note({.arrived = now,
              .sent = header->timestamp_us,
              .viewer = viewer.number,
              .frame = header->frame,
              .bytes = static_cast<std::uint32_t>(message.bytes),
              .kind = static_cast<std::uint8_t>(header->kind),
              .lacking = options_.follow && viewer.dependencies.closure().empty()});
    }

    void hang_up(Viewer& viewer) {
        viewer.tls.reset();
        ::close(viewer.socket);
        viewer.socket = -1;
    }

    // code: the WebSocket's; 0: the line was lost.
    void close(Viewer& viewer, int code) {
        if (viewer.socket < 0) return;
        hang_up(viewer);
        const auto now = microseconds_now();
        note({.arrived = now,
              .sent = 0,
              .viewer = viewer.number,
              .frame = static_cast<std::uint32_t>(code),
              .bytes = 0,
              .kind = Arrival::closed});
        const bool lost = code == 0 || code == static_cast<int>(live::CloseCode::shut_down) ||
                          code == static_cast<int>(live::CloseCode::try_later);
        if (!options_.follow || !lost) return;
        if (viewer.accepted && now - viewer.stood_since >= silence_us) viewer.hubs.held();
        viewer.comes_again = now + std::chrono::microseconds(viewer.hubs.next()).count();
    }

    // Slow viewers read a little; who watched long enough comes anew; a line on which nothing was heard is lost.
    void tick(std::int64_t now, double seconds) {
        const auto most = std::min(buffer_.size() - 1, static_cast<std::size_t>(options_.slow_bits / 8 * seconds));
        for (auto& viewer : viewers_) {
            if (viewer->socket < 0) continue;
            if (viewer->slow && viewer->accepted) hear(*viewer, most);
            if (options_.follow && now - viewer->heard > (viewer->accepted ? silence_us : handshake_us))
                close(*viewer, 0);
            if (viewer->socket >= 0 && options_.watch_seconds > 0 &&
                static_cast<double>(now - viewer->since) * 1e-6 > options_.watch_seconds) {
                hang_up(*viewer);
                connect(*viewer);
            }
        }
    }

    Options options_;
    int epoll_ = -1;
    std::FILE* output_ = nullptr;
    std::unique_ptr<SSL_CTX, FreeTls> tls_{};
    std::vector<std::unique_ptr<Viewer>> viewers_;
    std::vector<std::uint8_t> buffer_;
};

}  // namespace
}  // namespace htvm::live_bench

int main(int count, char** words) {
    htvm::live_bench::Options options;
    CLI::App app("Watches a live stream of a hub many times over and notes each packet's arrival");
    app.add_option("stream", options.stream, "Name of the stream")->required();
    app.add_option("-o,--output", options.output, "File for the arrivals: see bench/live/arrivals.py")->required();
    app.add_option("--host", options.host, "IPv4 address of the hub");
    app.add_option("--port", options.port, "Its port");
    app.add_option("--viewers", options.viewers, "How many");
    app.add_option("--slow", options.slow, "How many of them, the first, read slowly");
    app.add_option("--slow-bits", options.slow_bits, "Bits a second that a slow viewer reads (default 533000)");
    app.add_option("--seconds", options.seconds, "How long");
    app.add_option("--joins", options.joins_per_second, "Viewers that join in a second (default 400)");
    app.add_option("--again", options.watch_seconds, "Seconds after which a viewer leaves and joins again");
    app.add_flag("--tls", options.tls, "By TLS; any certificate is taken");
    app.add_flag("--follow", options.follow, "Who loses the hub goes to the next of those that it told of");
    app.add_option("--source", options.source, "Address of the first viewers (default 127.1.0.1); later ones count on");
    app.add_option("--per-source", options.per_source, "Viewers at each address (default 32)");
    CLI11_PARSE(app, count, words);
    return htvm::live_bench::Viewers(options).run() ? 0 : 1;
}
