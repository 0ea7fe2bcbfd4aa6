// The live streams of a server: who publishes them, and who watches. A publisher sends packets as they stand in a file;
// the first is a sequence header, and its checksum tells one session from another. Of packets only headers and
// checksums are read.
//
// A publisher whose connection broke comes back with the same session and goes on. Another session takes the stream
// over only once the old one has been silent for a while, so two publishers never mix.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "live/broadcast.h"

namespace htvm::live {

struct HubLimits {
    BroadcastLimits broadcast{};
    std::size_t streams = 256;
    std::size_t viewers = 4096;                        // of one stream
    std::size_t packet_bytes = std::size_t{16} << 20;  // of one packet
    std::chrono::milliseconds silence{2000};           // after which another session may take a stream over
    std::chrono::milliseconds remembered_without_publisher{10000};  // then the stream is gone
};

struct PublisherCounters {
    std::uint64_t packets = 0, bytes = 0;
    std::uint64_t damaged = 0;  // messages that are not one sound packet; they go no further
};

// What is told of a stream.
struct StreamInfo {
    std::string name;
    bool published = false;  // whether its publisher is connected
    std::size_t viewers = 0;
    PublisherCounters publisher;
    std::uint64_t undecodable_frames = 0;
    std::uint64_t dropped_frames = 0;  // for viewers who still watch
};

class Hub {
public:
    using Clock = Broadcast::Clock;
    struct Publisher {
        std::uint64_t connection = 0;
    };
    struct Viewer {
        std::string stream;
        std::uint64_t number = 0;  // of the stream: another one may have its name later
        Broadcast::Viewer viewer = 0;
    };

    explicit Hub(const HubLimits& limits = {}) : limits_(limits) {}

    // A connection that wants to publish under this name. taken_over: called with a sentence when another connection
    // goes on with the stream; this one is of no use any more. limit: there are too many streams.
    Result<Publisher> publish(const std::string& name, std::function<void(const std::string&)> taken_over);
    // The publisher's next message: one packet. A damaged one is counted and left out. bad_input: the first packet is
    // no sequence header, or the stream belongs to another session that was heard of lately; the sentence is meant for
    // the publisher, whose connection ends.
    Result<void> take(Publisher publisher, std::vector<std::uint8_t> message, Clock::time_point now);
    void leave(Publisher publisher, Clock::time_point now);

    // bad_input: there is no such stream; limit: it has too many viewers. wake: see Broadcast::join(). gone: called
    // when the stream ends.
    Result<Viewer> watch(const std::string& name, std::function<void()> wake, std::function<void()> gone,
                         Clock::time_point now);
    void leave(const Viewer& viewer);
    SharedPacket next(const Viewer& viewer);

    // Ends streams that have been without a publisher for too long; to be called every second or so.
    void tidy(Clock::time_point now);

    std::vector<StreamInfo> streams() const;
    const HubLimits& limits() const { return limits_; }

private:
    struct Stream {
        std::uint64_t number = 0;
        Broadcast broadcast;
        std::optional<std::uint64_t> connection;  // of the publisher, one of connections_, if it was admitted
        std::uint32_t session = 0;                // checksum of its sequence header
        Clock::time_point heard{};
        PublisherCounters counters;
        std::map<Broadcast::Viewer, std::function<void()>> gone;  // of each viewer
    };
    struct Connection {
        std::string stream;
        bool admitted = false;
        std::function<void(const std::string&)> taken_over;
    };
    Stream* stream_of(const Viewer& viewer);
    Result<void> admit(std::uint64_t number, Connection& connection, const PacketHeader& header, Clock::time_point now);

    HubLimits limits_;
    std::map<std::string, Stream> streams_;
    std::map<std::uint64_t, Connection> connections_;
    std::uint64_t next_connection_ = 0, next_stream_ = 0;
};

}  // namespace htvm::live
