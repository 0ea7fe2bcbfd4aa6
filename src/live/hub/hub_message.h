// What hubs on many machines say to each other (docs/live.md, "Many machines"), written and parsed. Whatever carries
// these messages may lose them, double them, and bring them out of order.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::live {

using Bytes = std::vector<std::uint8_t>;

// That a stream's publisher is connected to this hub. Where two hubs claim a name, the newer claim holds.
struct Claim {
    std::uint64_t hub = 0;   // drawn at random each time a hub starts
    std::int64_t began = 0;  // microseconds since 1970, by the hub's clock; above that of every claim it had heard of
    bool operator==(const Claim&) const = default;
};
// By the time, and if that is the same, by the hub: all hubs come to the same answer.
inline bool newer(const Claim& a, const Claim& b) { return a.began != b.began ? a.began > b.began : a.hub > b.hub; }

struct AnnouncedStream {
    std::string stream;
    std::int64_t began = 0;             // of the claim
    std::uint64_t checksum = 0;         // of its sequence header, which tells one session from another
    bool published = false;             // whether the publisher is connected at this moment
    std::optional<std::int64_t> clock;  // the publisher's, as its heartbeat has it, at this moment
    std::uint64_t next = 0;             // number of the packet that comes next
};
// All that a hub has publishers of: what was in the one before and is not in this one was withdrawn. Each second, and
// whenever it changes.
struct Announcement {
    std::string hub;  // its name, for people
    std::string url;  // where viewers and publishers reach it
    std::vector<AnnouncedStream> streams;
};

// The packets of a claim are numbered in the order in which they came from the publisher.
struct NumberedPacket {
    std::uint64_t number = 0;
    Bytes bytes;  // as it stands in a file
};
struct PublishedPacket {
    std::string stream;
    Claim claim;
    NumberedPacket packet;
};

// From a hub that wants a stream's packets, to the publisher's hub: each second, and when one of these is true.
struct StreamRequest {
    std::string stream;
    Claim claim;
    std::uint32_t viewers = 0;  // of the hub that asks
    bool closure = false;       // it also needs what the newest frame needs
    bool key_frame = false;     // its viewers ask for a frame that can be decoded by itself
};

// What the frame before packet `next` needs, and later ones may need, in the order in which to decode it.
struct ClosureAnswer {
    std::string stream;
    Claim claim;
    std::uint64_t next = 0;
    std::vector<NumberedPacket> packets;
};

using HubMessage = std::variant<Announcement, PublishedPacket, StreamRequest, ClosureAnswer>;

inline constexpr std::size_t longest_stream_name = 1024;
inline constexpr std::size_t most_part_bytes = std::size_t{512} << 10;  // NATS takes 1 MB
inline constexpr std::size_t most_parts = 96;                           // so a message has up to 48 MB

Bytes write_hub_message(const HubMessage& message);
// bad_input if it is not exactly one message.
Result<HubMessage> read_hub_message(std::span<const std::uint8_t> bytes);

// The message in parts of at most `part_bytes`, each saying which hub's which message it belongs to. Empty if there
// would be more than most_parts.
std::vector<Bytes> cut_into_parts(std::uint64_t hub, std::uint64_t number, std::span<const std::uint8_t> message,
                                  std::size_t part_bytes = most_part_bytes);

// Puts messages together again.
class PartReader {
public:
    // most_bytes: of messages that are not whole yet. The oldest are given up first.
    explicit PartReader(std::size_t most_bytes = std::size_t{96} << 20) : most_bytes_(most_bytes) {}
    struct Whole {
        std::uint64_t hub = 0;  // that wrote it
        Bytes message;
    };
    // The message that this part makes whole. Nothing if others are missing, or it is no part.
    std::optional<Whole> add(std::span<const std::uint8_t> part);

    std::uint64_t damaged() const { return damaged_; }        // what was no part of a message
    std::uint64_t incomplete() const { return incomplete_; }  // messages given up
    std::size_t waiting_bytes() const { return bytes_; }

private:
    struct Begun {
        std::uint64_t age = 0;
        std::size_t missing = 0;
        std::vector<std::optional<Bytes>> parts;
    };
    using Key = std::pair<std::uint64_t, std::uint64_t>;  // hub, number
    void give_up_oldest();

    std::size_t most_bytes_;
    std::map<Key, Begun> begun_;
    std::map<std::uint64_t, Key> by_age_;
    std::uint64_t next_age_ = 0, damaged_ = 0, incomplete_ = 0;
    std::size_t bytes_ = 0;
};

// Subjects. A stream's name is escaped, so that none can name the subject of another, or a pattern.
std::string announcements_subject();
std::string hub_subject(std::uint64_t hub);  // requests and answers to it
std::string packets_subject(std::string_view stream);

}  // namespace htvm::live
