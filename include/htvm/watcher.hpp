// Watches a live stream of a hub: its packets, one after the other, as if they were read from a file (docs/live.md).
// htvm::live has it.
//
//   auto watcher = htvm::Watcher::open("wss://hub.example/watch/anna");       // Result<Watcher>
//   htvm::Decoder decoder;
//   while (auto packet = watcher->next()) {                                     // Result<std::optional<Packet>>
//       if (!*packet) break;                                                    // the stream has ended
//       if (auto frame = decoder.decode(**packet); frame && *frame) show((*frame)->mesh);
//   }
//
// A lost line or a restarted hub ends nothing: the watcher connects again, to the next of the hubs that it knows, and
// goes on; what it has had is left out. What the owner does not take in time the hub drops, by the rule of
// dependency.hpp, so that what does come can be decoded.
//
// Threads. It has one of its own, which reads from the line; of the caller's threads one at a time may use it, but for
// stop() and state(), which any may call at any time. What next() gives is the caller's.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct WatcherOptions {
    std::string certificates{};  // PEM file of those who may vouch for a hub's; empty: the system's
    std::string token{};         // shown to hubs that ask who watches; one line of printable characters; empty: none
    bool insecure = false;       // takes any certificate: for tests alone
    std::size_t largest_packet = std::size_t{1} << 28;  // bytes of its payload; the connection ends at larger ones
    std::function<bool()> is_stopped{};                 // asked ten times a second by next(); empty: never
    std::function<void(const std::string&)> trouble{};  // told when the line is lost, and why; by next()
};

struct WatcherState {
    bool connected = false;
    std::uint64_t connections = 0;       // made so far
    std::uint64_t damaged_messages = 0;  // that were not one sound packet
    std::uint64_t damaged_bytes = 0;     // of them
    std::uint64_t dropped_frames = 0;    // that the hub did not send, since this viewer did not take them in time
};

class Watcher {
public:
    struct State;  // opaque

    // Connects in the background. url: ws://HOST[:PORT]/watch/NAME[?expires=...&key=...&signature=...], or wss:// for
    // TLS. bad_input if the address is wrong or the certificates cannot be read.
    static Result<Watcher> open(const std::string& url, const WatcherOptions& options = {});
    Watcher(Watcher&&) noexcept;
    Watcher& operator=(Watcher&&) noexcept;
    ~Watcher();  // ends the connection at once; no thread may be in next()

    // Waits for the next packet. Nothing where the stream has ended, or it is stopped; bad_input if the hub refuses to
    // show it.
    Result<std::optional<Packet>> next();
    // Likewise, but gives up after this time: limit.
    Result<std::optional<Packet>> next(std::chrono::milliseconds timeout);
    // Ends next(), now and for good.
    void stop();
    WatcherState state() const;

private:
    explicit Watcher(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
