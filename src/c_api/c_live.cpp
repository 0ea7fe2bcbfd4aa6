// Live streams in C (htvm/htvm_live.h), on top of htvm::Publisher and htvm::Watcher.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "c_api/c_status.h"
#include "htvm/htvm_live.h"
#include "htvm/packet.hpp"
#include "htvm/publisher.hpp"
#include "htvm/watcher.hpp"

using htvm::c_api::guarded;
using htvm::c_api::LastError;

struct htvm_publisher {
    htvm::Publisher publisher;
    LastError error;
};

struct htvm_watcher {
    htvm::Watcher watcher;
    LastError error;
    std::vector<std::uint8_t> lent = {};  // the packet
};

namespace {

htvm_live_options default_live_options() {
    htvm_live_options out{};
    out.struct_size = sizeof out;
    return out;
}

// Makes a handle, or gives what went wrong to the caller's text. make(url, options) gives Result<its contents>.
template <class Handle, class Make>
htvm_status create(const char* url, const htvm_live_options* given, Handle** handle, char* problem,
                   std::size_t capacity, const Make& make) {
    if (!handle) return HTVM_BAD_INPUT;
    *handle = nullptr;
    LastError error;
    const auto status = guarded(error, [&] {
        if (!url) return error.set(HTVM_BAD_INPUT, "the address is NULL");
        auto options = default_live_options();
        if (given)
            if (const auto fits =
                    htvm::c_api::check_struct(error, htvm::c_api::read_struct(given, options), "htvm_live_options");
                fits != HTVM_OK)
                return fits;
        auto made = make(std::string(url), options);
        if (!made) return error.set(made.error());
        *handle = new Handle{std::move(*made), {}};
        return htvm_status{HTVM_OK};
    });
    if (problem && capacity > 0) {
        const auto length = std::min(std::strlen(error.text.data()), capacity - 1);
        std::memcpy(problem, error.text.data(), length);
        problem[length] = '\0';
    }
    return status;
}

std::string text_of(const char* text) { return text ? text : ""; }

// All of the bytes; nothing if they are not whole, sound packets.
std::optional<std::vector<htvm::Packet>> packets_of(const std::uint8_t* bytes, std::size_t count) {
    htvm::PacketReader reader;
    reader.push({bytes, count});
    std::vector<htvm::Packet> out;
    while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    if (reader.damaged_bytes() > 0 || reader.pending_bytes() > 0) return std::nullopt;
    return out;
}

}  // namespace

htvm_status htvm_live_options_init(htvm_live_options* options, std::size_t options_size) {
    return htvm::c_api::init_struct(default_live_options(), options, options_size);
}

htvm_status htvm_publisher_create(const char* url, const htvm_live_options* options, htvm_publisher** publisher,
                                  char* problem, std::size_t problem_capacity) {
    return create(url, options, publisher, problem, problem_capacity,
                  [](const std::string& address, const htvm_live_options& given) {
                      htvm::PublisherOptions out;
                      out.token = text_of(given.token);
                      out.certificates = text_of(given.certificates);
                      out.insecure = given.insecure != 0;
                      return htvm::Publisher::open(address, out);
                  });
}

void htvm_publisher_destroy(htvm_publisher* publisher) { delete publisher; }

htvm_status htvm_publisher_send(htvm_publisher* publisher, const std::uint8_t* bytes, std::size_t count) {
    if (!publisher) return HTVM_BAD_INPUT;
    auto& error = publisher->error;
    return guarded(error, [&] {
        if (!bytes && count > 0) return error.set(HTVM_BAD_INPUT, "the bytes are NULL");
        const auto packets = packets_of(bytes, count);
        if (!packets) return error.set(HTVM_CORRUPT_STREAM, "the bytes are not whole packets");
        for (const auto& packet : *packets)
            if (const auto sent = publisher->publisher.send(packet); !sent) return error.set(sent.error());
        return htvm_status{HTVM_OK};
    });
}

int htvm_publisher_wants_key_frame(htvm_publisher* publisher) {
    return publisher && publisher->publisher.wants_key_frame() ? 1 : 0;
}

htvm_status htvm_publisher_get_state(htvm_publisher* publisher, htvm_publisher_state* state, std::size_t state_size) {
    if (!publisher) return HTVM_BAD_INPUT;
    return guarded(publisher->error, [&] {
        const auto now = publisher->publisher.state();
        htvm_publisher_state out{};
        out.connected = now.connected ? 1 : 0;
        out.connections = now.connections;
        out.sent_packets = now.sent_packets;
        out.sent_bytes = now.sent_bytes;
        out.dropped_frames = now.dropped_frames;
        out.queue_bytes = now.queue_bytes;
        out.viewers = now.viewers.value_or(0);
        return htvm::c_api::write_struct(out, state, state_size);
    });
}

htvm_status htvm_publisher_finish(htvm_publisher* publisher, int ends, std::uint32_t timeout_ms) {
    if (!publisher) return HTVM_BAD_INPUT;
    auto& error = publisher->error;
    return guarded(error, [&] {
        const std::chrono::milliseconds timeout(timeout_ms);
        const auto done = ends ? publisher->publisher.finish(timeout) : publisher->publisher.leave(timeout);
        return done ? htvm_status{HTVM_OK} : error.set(done.error());
    });
}

const char* htvm_publisher_last_error(const htvm_publisher* publisher) {
    return publisher ? publisher->error.text.data() : "";
}

htvm_status htvm_watcher_create(const char* url, const htvm_live_options* options, htvm_watcher** watcher,
                                char* problem, std::size_t problem_capacity) {
    return create(url, options, watcher, problem, problem_capacity,
                  [](const std::string& address, const htvm_live_options& given) {
                      htvm::WatcherOptions out;
                      out.certificates = text_of(given.certificates);
                      out.insecure = given.insecure != 0;
                      return htvm::Watcher::open(address, out);
                  });
}

void htvm_watcher_destroy(htvm_watcher* watcher) { delete watcher; }

htvm_status htvm_watcher_receive(htvm_watcher* watcher, std::uint32_t timeout_ms, const std::uint8_t** bytes,
                                 std::size_t* count) {
    if (!watcher) return HTVM_BAD_INPUT;
    auto& error = watcher->error;
    return guarded(error, [&] {
        if (!bytes || !count) return error.set(HTVM_BAD_INPUT, "the place for the bytes or their count is NULL");
        *bytes = nullptr;
        *count = 0;
        const auto packet = watcher->watcher.next(std::chrono::milliseconds(timeout_ms));
        if (!packet && packet.error().kind == htvm::ErrorKind::limit) return htvm_status{HTVM_AGAIN};
        if (!packet) return error.set(packet.error());
        if (!*packet) return htvm_status{HTVM_END};
        watcher->lent = htvm::write_packet(**packet);
        *bytes = watcher->lent.data();
        *count = watcher->lent.size();
        return htvm_status{HTVM_OK};
    });
}

void htvm_watcher_stop(htvm_watcher* watcher) {
    if (watcher) watcher->watcher.stop();
}

const char* htvm_watcher_last_error(const htvm_watcher* watcher) { return watcher ? watcher->error.text.data() : ""; }
