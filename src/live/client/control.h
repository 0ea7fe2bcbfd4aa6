// The text messages that a hub, its publishers and its viewers send each other beside the packets (docs/live.md,
// section 2), and the codes with which connections are closed (section 4). A message is a plain struct; what is written
// is one JSON object of at most most_text_bytes.
//
// Reading is for one direction at a time, since a heartbeat has other members in each. Types and members that are not
// known are passed over, so that later versions can add some.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::live {

inline constexpr const char* live_protocol = "htvm.1";  // the WebSockets' subprotocol
inline constexpr std::uint32_t protocol_version = 1;
inline constexpr std::size_t most_text_bytes = 4096;

// Why a connection is closed.
enum class CloseCode : std::uint16_t {
    ended = 1000,       // the stream ended
    shut_down = 1001,   // the hub shuts down
    refused = 1008,     // token, link, session or message
    too_large = 1009,   // a message
    try_later = 1013,   // no such stream yet, or too many streams or viewers
    continued = 4000,   // this session was continued by another connection
    taken_over = 4001,  // another session took the stream over
};

// A word, to count by.
constexpr const char* name_of(CloseCode code) {
    switch (code) {
        case CloseCode::ended:
            return "ended";
        case CloseCode::shut_down:
            return "shut_down";
        case CloseCode::refused:
            return "refused";
        case CloseCode::too_large:
            return "too_large";
        case CloseCode::try_later:
            return "try_later";
        case CloseCode::continued:
            return "continued";
        case CloseCode::taken_over:
            return "taken_over";
    }
    return "other";
}

// Numbers are whole, and within ±2^53, so that every reader of JSON holds them exactly. Times are microseconds;
// a clock tells stream time: what the timestamps of frames count.

// The first message of a hub to everybody.
struct Hello {
    std::uint32_t version = protocol_version;
    std::string stream{};
    std::optional<std::uint64_t> session{};  // none before the first packet, or if the publisher has none
    std::vector<std::string> hubs{};         // addresses of other hubs; those that do not fit are not written
};

struct HeartbeatFromPublisher {
    std::optional<std::int64_t> clock{};  // at this moment; none before the first frame
};

// The stream ends with this connection: nobody goes on with it. Without this, a hub waits for who comes back.
struct EndOfStream {};

struct HeartbeatToPublisher {
    std::uint64_t viewers = 0;
    std::uint64_t packets = 0, bytes = 0;  // taken from this publisher
    std::uint64_t damaged = 0;             // messages that were no sound packet
};

struct HeartbeatToViewer {
    bool published = false;                // whether a publisher is connected
    std::optional<std::int64_t> clock{};   // the publisher's at this moment, if it told one
    std::optional<std::uint64_t> session;  // as in Hello
    std::uint64_t viewers = 0;
    std::uint64_t dropped = 0;  // frames that this viewer was not sent
};

// Asks for a frame that can be decoded by itself: a viewer the hub, the hub its publisher.
struct KeyFrameRequest {};

struct Gone {
    std::string reason{};  // why the publisher's connection, or the stream, ended
};

// Now by the system clock: microseconds since 1970, as stamps tell it, and claims of hubs.
std::int64_t system_microseconds();

// When a frame was sent, for measurement; it comes right before the frame's packet. By the system clocks, since 1970.
struct Stamp {
    std::uint32_t frame = 0;            // the number in the packet's header
    std::int64_t sent = 0;              // by the publisher
    std::optional<std::int64_t> hub{};  // when the packet came to the hub; the publisher does not know it
};

std::string write_text(const Hello& message);
std::string write_text(const HeartbeatFromPublisher& message);
std::string write_text(const EndOfStream& message);
std::string write_text(const HeartbeatToPublisher& message);
std::string write_text(const HeartbeatToViewer& message);
std::string write_text(const KeyFrameRequest& message);
std::string write_text(const Gone& message);
std::string write_text(const Stamp& message);

// bad_input, with a sentence for the sender: the text is too long, is no JSON object with a "type", lacks a member that
// its type must have, or one is of another kind or out of range. monostate: a type that this direction does not know.
using FromPublisher = std::variant<std::monostate, HeartbeatFromPublisher, Stamp, EndOfStream>;
using FromViewer = std::variant<std::monostate, KeyFrameRequest>;
using ToPublisher = std::variant<std::monostate, Hello, HeartbeatToPublisher, KeyFrameRequest>;
using ToViewer = std::variant<std::monostate, Hello, HeartbeatToViewer, Gone, Stamp>;
Result<FromPublisher> read_from_publisher(std::string_view text);
Result<FromViewer> read_from_viewer(std::string_view text);
Result<ToPublisher> read_to_publisher(std::string_view text);
Result<ToViewer> read_to_viewer(std::string_view text);

// A session as messages and pages spell it: 16 hexadecimal digits.
std::string session_text(std::uint64_t session);

}  // namespace htvm::live
