// The live streams of a hub as segments and playlists (docs/mp4.md), from memory, for viewers behind caches: what
// thousands watch is asked for once by each cache. The packets that go to viewers are cut where players can start; a
// window of segments is kept, and with parts what has come of the newest one, too.
//
// The rungs of a ladder (stream_name.h) that one encoder publishes are cut at the same times, and their segments of the
// same frames have the same numbers and dates, so that players go from one to another.
//
// Names of segments and maps are made of their contents, so they never mean other bytes. Numbers of segments begin with
// the time, so they ascend although the hub is started anew. What is held counts as the stream's memory in the hub, and
// goes where the stream gives way.
//
// Threads: what is called by the hub, and tick(), run on the hub's; playlist() and file() may be called on any.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "live/hub/hub.h"

namespace htvm::live {

struct LiveSegmentOptions {
    double seconds = 2;          // that a segment lasts at least: it ends where players can start
    double part_seconds = 0;     // that no part of it is longer than; 0: whole segments alone
    double window_seconds = 60;  // of each stream, that the playlist has
    std::size_t stream_bytes = std::size_t{128} << 20;  // of each stream; where these are fewer seconds, so many
    std::size_t waiting = 4096;                         // requests at once for what is not there yet
    std::chrono::milliseconds remembered{60000};        // a stream that has ended
};

struct LiveSegmentCounters {
    std::uint64_t streams = 0;           // that have segments now
    std::uint64_t segments = 0;          // made,
    std::uint64_t parts = 0, bytes = 0;  // likewise
    std::uint64_t held_bytes = 0;        // now
    std::uint64_t waiting = 0;           // requests, now
    std::uint64_t refused_waiting = 0;   // since there were too many
    std::uint64_t lost = 0;              // segments that were not finished: no memory, or nowhere to start for too long
};

class LiveSegments {
public:
    using Clock = Hub::Clock;

    LiveSegments(const LiveSegmentOptions& options, Hub& hub);
    LiveSegments(LiveSegments&&) = delete;
    LiveSegments& operator=(LiveSegments&&) = delete;
    ~LiveSegments();

    // Somebody who waits, as long as this lives. `wake` is called on the hub's thread whenever there is something new.
    class Waiting;
    using Waits = std::shared_ptr<Waiting>;
    using Wake = std::function<void()>;

    struct Found {
        enum class State : std::uint8_t {
            there,
            waits,     // not yet, but soon: `waiting` is who waits for it
            too_many,  // likewise, but too many wait already
            too_far,   // what is asked for is not what comes next
            nothing,   // there is no such thing, or no more
        };
        State state = State::nothing;
        std::shared_ptr<const std::string> bytes{};  // which `content` is of
        std::string_view content{};
        std::string tag{};  // of a playlist: the entity tag
        Waits waiting{};
        double patience = 0;  // seconds for which to wait at most
    };
    // What a player asks for that has the playlist up to here: one in which this segment, or this part of it, is.
    struct Position {
        std::uint64_t segment = 0;
        std::optional<std::uint64_t> part{};
    };
    Found playlist(const std::string& stream, const std::optional<Position>& position, const Wake& wake);
    // The list of the playlists of a ladder's rungs, the streams NAME~1 to NAME~8, and of the stream NAME itself, as
    // far as they are there. patient: while one of them has no segment yet, that is waited for.
    Found ladder(const std::string& name, bool patient, const Wake& wake);
    // A map, a segment or a part.
    Found file(const std::string& stream, const std::string& name, const Wake& wake);

    // Forgets streams that ended; to be called ten times a second.
    void tick(Clock::time_point now);
    LiveSegmentCounters counters() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
