// Watches a live stream of a hub: its packets, one after the other, as if they were read from a file. A lost line or a
// restarted hub ends nothing: the watcher connects again and goes on; what it has had is left out.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::live {

struct WatcherOptions {
    std::string certificates;  // as in PublisherOptions
    bool insecure = false;
    std::size_t largest_packet = std::size_t{1} << 28;  // bytes of its payload; the connection ends at larger ones
    std::function<bool()> is_stopped;                   // asked ten times a second; empty: never
    std::function<void(const std::string&)> trouble;    // told when the line is lost, and why; by next()
};

struct WatcherState {
    bool connected = false;
    std::uint64_t connections = 0;
    std::uint64_t damaged_messages = 0;  // that were not one sound packet
    std::uint64_t damaged_bytes = 0;     // of them
    std::uint64_t dropped_frames = 0;    // that the hub did not send, since this viewer did not take them in time
};

class Watcher {
public:
    struct State;  // opaque

    // Connects in the background. url: ws://HOST[:PORT]/watch/NAME[?expires=...&key=...&signature=...], or wss://.
    static Result<Watcher> open(const std::string& url, const WatcherOptions& options = {});
    Watcher(Watcher&&) noexcept;
    Watcher& operator=(Watcher&&) noexcept;
    ~Watcher();

    // Waits for the next packet. Nothing where the stream has ended, or it is stopped; bad_input if the hub refuses to
    // show it.
    Result<std::optional<Packet>> next();
    WatcherState state() const;

private:
    explicit Watcher(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
