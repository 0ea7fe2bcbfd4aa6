// A client's side of the connection to a hub: WebSocket htvm.1 (docs/live.md), by TLS or not. It stays connected: where
// the line is lost, or nothing was heard for three seconds, it connects again, to the next of the hubs it knows. What
// is said over it is the business of its owner: a publisher or a watcher.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/client/broadcast.h"
#include "live/client/hub_list.h"

namespace htvm::live {

struct HubClientOptions {
    std::string token;         // sent as Authorization: Bearer; empty: none
    std::string certificates;  // PEM file of those who may vouch for a hub; empty: the system's
    bool insecure = false;     // takes any certificate
    std::size_t largest_message = std::size_t{1} << 20;  // that is taken, bytes
    std::chrono::milliseconds handshake{5000};           // for connecting, each of its steps
    std::chrono::milliseconds silence{3000};             // after which the line is dead
    std::chrono::milliseconds patience{3000};  // with refusals for now, as of a stream that was another session's a
                                               // moment ago
};

// How a connection ended, or why there was none.
struct HubEnding {
    enum class Kind : std::uint8_t {
        lost,     // connects again
        refused,  // by the hub, or this client refuses the hub's certificate
        ended,    // the stream did
    };
    Kind kind = Kind::lost;
    bool for_now = false;  // refused: perhaps not in a moment
    std::string reason;    // a sentence without an end, for people
};

// What the owner does. All is called on the client's thread, and must not block. Only lost and ended must be there.
struct HubTalk {
    std::function<void()> connected;
    // The next packet to send; null: none for now, wake() says when there is one.
    std::function<SharedPacket()> next;
    std::function<std::string(const LivePacket&)> before;           // a text to send right before it; empty: none
    std::function<void(std::vector<std::uint8_t>)> receive_packet;  // a binary message, whatever is in it
    std::function<void(const std::string&)> receive_text;           // at most 4,096 bytes
    std::function<bool()> may_read;                                 // else what comes stays in the line until wake()
    std::function<std::string()> heartbeat;                         // a text for each second; empty: none
    std::function<void(const HubEnding&)> lost;                     // of each connection; it will be tried again
    std::function<void(const HubEnding&)> ended;                    // of the last one: nothing is called behind it
};

struct HubClientStatus {
    bool connected = false;
    std::string hub;  // the address in use, without secrets
    std::uint64_t connections = 0;
    std::optional<std::chrono::microseconds> round_trip;
};

class HubClient {
public:
    // Reads the certificates. Nothing happens before start().
    static Result<HubClient> create(std::vector<HubAddress> hubs, const HubClientOptions& options, HubTalk talk);
    HubClient(HubClient&&) noexcept;
    HubClient& operator=(HubClient&&) noexcept;
    ~HubClient();  // ends at once

    void start();
    // From any thread: there is something to send, or to read again.
    void wake();
    // A text message; on the client's thread only. It goes before packets that wait.
    void say(std::string text);
    // Other hubs, as a hub tells of them; on the client's thread only.
    void learn(const std::vector<std::string>& hubs);
    // From any thread: sends what next() still has, then this text, if it is not empty, and ends with code 1000.
    void finish(std::string last_words = {});
    // From any thread but the client's: ends at once; nothing is called behind it.
    void stop();
    HubClientStatus status() const;

private:
    struct State;
    explicit HubClient(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

// A text from the other side, for a terminal: its control characters are left out, and it is short.
std::string printable(std::string_view text);

}  // namespace htvm::live
