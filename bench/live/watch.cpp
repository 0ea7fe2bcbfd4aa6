// Many viewers of one live stream in one process, for measurements: bench/live/load.py and lossy_line.py run it. They
// take what a hub sends as WebSockets, decode nothing, and note when each packet came. bench/live/publish.py writes the
// time of sending into each packet's timestamp (CLOCK_MONOTONIC, which all processes of a machine share, in other
// network namespaces too), so the delay is known without any other message. bench/live/arrivals.py reads what is noted.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
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
#include <span>
#include <string>
#include <vector>

#include "htvm/packet.hpp"

namespace htvm::live_bench {
namespace {

struct Options {
    std::string stream = "person", host = "127.0.0.1", source = "127.1.0.1", output;
    std::uint16_t port = 8080;
    unsigned viewers = 1, per_source = 32, slow = 0;
    double seconds = 10, joins_per_second = 400, watch_seconds = 0, slow_bits = 533000;
};

// What one arrival is noted as; arrivals.py has the same fields.
struct Arrival {
    std::int64_t arrived;  // microseconds by CLOCK_MONOTONIC
    std::int64_t sent;     // by the publisher; 0 for what is no packet
    std::uint32_t viewer;
    std::uint32_t frame;  // of `closed`: the reason, as a WebSocket's code
    std::uint32_t bytes;
    std::uint8_t kind;  // a PacketKind, or one of these:
    std::uint8_t unused[3] = {};
    static constexpr std::uint8_t connecting = 200, closed = 201;
};
static_assert(sizeof(Arrival) == 32);

std::int64_t microseconds_now() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000;
}

// Opcodes of RFC 6455, section 5.2.
constexpr std::uint8_t binary_message = 2, close_message = 8, ping_message = 9, pong_message = 10;

// A message of which the beginning is kept.
struct Message {
    std::uint8_t opcode = 0;
    std::size_t bytes = 0;
    std::array<std::uint8_t, packet_header_bytes> begin{};
    void add(std::span<const std::uint8_t> piece) {
        if (bytes < begin.size())
            std::copy_n(piece.begin(), std::min(piece.size(), begin.size() - bytes),
                        begin.begin() + static_cast<std::ptrdiff_t>(bytes));
        bytes += piece.size();
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
                message() = {};
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

struct Viewer {
    std::uint32_t number = 0;
    int socket = -1;
    bool slow = false;
    bool asked = false, accepted = false;  // the HTTP request was sent, and answered
    std::size_t line_ends = 0;             // of the answer's end, "\r\n\r\n", so many bytes came
    std::int64_t since = 0;                // when it began to connect
    MessageReader reader;
};

class Viewers {
public:
    explicit Viewers(const Options& options) : options_(options), buffer_(std::size_t{1} << 18) {}

    bool run() {
        epoll_ = ::epoll_create1(0);
        output_ = std::fopen(options_.output.c_str(), "wb");
        if (epoll_ < 0 || !output_) return fail(options_.output);
        for (unsigned i = 0; i < options_.viewers; ++i) {
            viewers_.push_back(std::make_unique<Viewer>());
            viewers_.back()->number = i;
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

    static bool fail(const std::string& what) {
        fmt::print(stderr, "live_watch: {}: {}\n", what, std::strerror(errno));
        return false;
    }
    void note(const Arrival& arrival) { std::fwrite(&arrival, sizeof arrival, 1, output_); }

    bool connect(Viewer& viewer) {
        viewer.socket = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (viewer.socket < 0) return fail("socket");
        viewer.since = microseconds_now();
        viewer.reader = {};
        viewer.asked = viewer.accepted = false;
        viewer.line_ends = 0;
        constexpr int yes = 1, small = 16384;
        ::setsockopt(viewer.socket, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &yes, sizeof yes);
        if (viewer.slow) ::setsockopt(viewer.socket, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        sockaddr_in source{}, hub{};
        source.sin_family = hub.sin_family = AF_INET;
        hub.sin_port = htons(options_.port);
        ::inet_pton(AF_INET, options_.source.c_str(), &source.sin_addr);
        ::inet_pton(AF_INET, options_.host.c_str(), &hub.sin_addr);
        source.sin_addr.s_addr = htonl(ntohl(source.sin_addr.s_addr) + viewer.number / options_.per_source);
        if (::bind(viewer.socket, reinterpret_cast<const sockaddr*>(&source), sizeof source) != 0)
            return fail("bind " + options_.source);
        if (::connect(viewer.socket, reinterpret_cast<const sockaddr*>(&hub), sizeof hub) != 0 && errno != EINPROGRESS)
            return fail("connect " + options_.host);
        epoll_event event{};
        event.events = EPOLLOUT;
        event.data.ptr = &viewer;
        ::epoll_ctl(epoll_, EPOLL_CTL_ADD, viewer.socket, &event);
        note({.arrived = viewer.since,
              .sent = 0,
              .viewer = viewer.number,
              .frame = 0,
              .bytes = 0,
              .kind = Arrival::connecting});
        return true;
    }

    void ask(Viewer& viewer) {
        const auto request = fmt::format(
            "GET /watch/{} HTTP/1.1\r\nHost: {}:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: aHR2bSBsaXZlIGJlbmNoIQ==\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: htvm.1\r\n\r\n",
            options_.stream, options_.host, options_.port);
        if (::send(viewer.socket, request.data(), request.size(), MSG_NOSIGNAL) < 0) return close(viewer, 0);
        viewer.asked = true;
        epoll_event event{};
        event.events = EPOLLIN;
        event.data.ptr = &viewer;
        ::epoll_ctl(epoll_, EPOLL_CTL_MOD, viewer.socket, &event);
    }

    // Reads at most so many bytes of what came.
    void hear(Viewer& viewer, std::size_t most) {
        if (viewer.socket < 0) return;
        if (!viewer.asked) return ask(viewer);
        if (viewer.slow && viewer.accepted && most == buffer_.size()) {
            ::epoll_ctl(epoll_, EPOLL_CTL_DEL, viewer.socket, nullptr);  // tick() reads from now on
            return;
        }
        const auto count = ::recv(viewer.socket, buffer_.data(), most, 0);
        if (count == 0 || (count < 0 && errno != EAGAIN)) return close(viewer, 0);
        if (count < 0) return;
        std::span<const std::uint8_t> bytes(buffer_.data(), static_cast<std::size_t>(count));
        while (!viewer.accepted && !bytes.empty()) {
            constexpr std::array<std::uint8_t, 4> ending = {'\r', '\n', '\r', '\n'};
            viewer.line_ends = bytes.front() == ending[viewer.line_ends] ? viewer.line_ends + 1 : bytes.front() == '\r';
            viewer.accepted = viewer.line_ends == ending.size();
            bytes = bytes.subspan(1);
        }
        const auto now = microseconds_now();
        viewer.reader.push(bytes, [&](const Message& message) { take(viewer, message, now); });
    }

    void take(Viewer& viewer, const Message& message, std::int64_t now) {
        if (message.opcode == close_message) return close(viewer, message.begin[0] << 8 | message.begin[1]);
        if (message.opcode == ping_message) {
            constexpr std::array<std::uint8_t, 6> pong = {128 | pong_message, 128, 0, 0, 0, 0};
            ::send(viewer.socket, pong.data(), pong.size(), MSG_NOSIGNAL);
        }
        if (message.opcode != binary_message) return;
        std::uint32_t payload_bytes = 0;
        const auto header = read_packet_header(message.begin, payload_bytes);
        if (!header) return;
        note({.arrived = now,
              .sent = header->timestamp_us,
              .viewer = viewer.number,
              .frame = header->frame,
              .bytes = static_cast<std::uint32_t>(message.bytes),
              .kind = static_cast<std::uint8_t>(header->kind)});
    }

    void close(Viewer& viewer, int code) {
        if (viewer.socket < 0) return;
        ::close(viewer.socket);
        viewer.socket = -1;
        note({.arrived = microseconds_now(),
              .sent = 0,
              .viewer = viewer.number,
              .frame = static_cast<std::uint32_t>(code),
              .bytes = 0,
              .kind = Arrival::closed});
    }

    // Slow viewers read a little; who watched long enough comes anew.
    void tick(std::int64_t now, double seconds) {
        const auto most = std::min(buffer_.size() - 1, static_cast<std::size_t>(options_.slow_bits / 8 * seconds));
        for (auto& viewer : viewers_) {
            if (viewer->socket < 0) continue;
            if (viewer->slow && viewer->accepted) hear(*viewer, most);
            if (options_.watch_seconds > 0 &&
                static_cast<double>(now - viewer->since) * 1e-6 > options_.watch_seconds) {
                ::close(viewer->socket);
                viewer->socket = -1;
                connect(*viewer);
            }
        }
    }

    Options options_;
    int epoll_ = -1;
    std::FILE* output_ = nullptr;
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
    app.add_option("--source", options.source, "Address of the first viewers (default 127.1.0.1); later ones count on");
    app.add_option("--per-source", options.per_source, "Viewers at each address (default 32)");
    CLI11_PARSE(app, count, words);
    return htvm::live_bench::Viewers(options).run() ? 0 : 1;
}
