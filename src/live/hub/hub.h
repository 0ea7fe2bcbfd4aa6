// The live streams of a server: who publishes them, and who watches. A publisher sends packets as they stand in a file;
// the first is a sequence header, and its checksum tells one session from another. The hub reads
// only headers and checksums of packets, and what sequence headers tell of the stream.
//
// A publisher whose connection broke comes back with the same session and goes on. Another session takes the stream
// over only once the old one has been silent for a while, so two publishers never mix.
//
// There is no network here: a server passes on what connections say, calls tick(), and writes for each connection what
// next() gives: packets, and the text messages of live/client/control.h. Texts are made when they are written, so none
// waits in a queue, and they come before packets that wait.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "htvm/result.hpp"
#include "live/client/broadcast.h"
#include "live/client/control.h"
#include "live/hub/event.h"
#include "live/hub/histogram.h"
#include "live/hub/hub_memory.h"

namespace htvm::live {

struct HubLimits {
    BroadcastLimits broadcast{};
    std::size_t streams = 256;
    std::size_t viewers = 4096;                              // of one stream
    std::size_t packet_bytes = std::size_t{16} << 20;        // of one packet
    std::size_t first_message_bytes = std::size_t{1} << 20;  // of the first: a sequence header has 0.3 MiB at most
    // All packets together, each counted once: kept for those who may join, waiting for viewers, and those that
    // have come in part. Beyond it the stream that holds most gives way: who publishes it is refused what needs more,
    // and where it is others that need it, loses what waits and is kept.
    std::size_t memory = std::size_t{1} << 30;
    std::size_t stream_memory = std::size_t{256} << 20;  // of that, of one stream; beyond it what it sends is dropped
    std::chrono::milliseconds message_time{30000};       // from a message's first part to its last
    std::chrono::milliseconds silence{2000};             // after which another session may take a stream over
    std::chrono::milliseconds publisher_silence{3000};   // after which its connection is ended
    std::chrono::milliseconds remembered_without_publisher{10000};  // then the stream is gone
    std::chrono::milliseconds heartbeat{1000};                      // from one to the next
    std::chrono::milliseconds key_frame{1000};  // at least, from one request to a publisher to the next
};

struct PublisherCounters {
    std::uint64_t packets = 0, bytes = 0;
    std::uint64_t damaged = 0;  // messages that are not one sound packet; they go no further
};

// What is told of a stream.
struct StreamInfo {
    std::string name;
    bool published = false;                     // whether its publisher is connected,
    bool far = false;                           // to another hub
    std::uint64_t connection = 0;               // the publisher's, while it is connected; each has another number
    std::uint32_t checksum = 0;                 // of its sequence header, which tells one session from another
    std::uint64_t next_place = 0;               // of the packet that comes next
    std::size_t viewers = 0, viewers_afar = 0;  // here, and on other hubs
    PublisherCounters publisher;
    std::uint64_t undecodable_frames = 0;
    std::uint64_t dropped_frames = 0;      // for viewers who still watch
    std::size_t queue_bytes = 0;           // waiting for viewers
    std::size_t kept_bytes = 0;            // for those who may still join
    std::uint64_t key_frame_requests = 0;  // passed to publishers
    // As the sequence header tells it; none if it cannot be read. Frames a second as a fraction.
    struct Header {
        std::uint64_t session = 0;  // 0: none
        std::uint32_t fps_numerator = 0, fps_denominator = 1;
    };
    std::optional<Header> header;
    std::optional<std::int64_t> clock;                         // the publisher's now, microseconds
    std::optional<std::chrono::milliseconds> since_packet;     // since the last one
    std::optional<std::chrono::milliseconds> since_heartbeat;  // since the publisher's last one
};

// Since the hub began, over all streams, also those that ended.
struct HubCounters {
    std::uint64_t packets_in = 0, bytes_in = 0, packets_out = 0, bytes_out = 0;
    std::uint64_t damaged_messages = 0;
    std::uint64_t undecodable_frames = 0;  // not sent to anybody: what they refer to did not come
    std::uint64_t dropped_frames = 0;      // not sent to viewers who were too slow
    std::uint64_t fallen_behind = 0;       // how often viewers were
    std::uint64_t key_frame_requests = 0;  // passed to publishers
    std::uint64_t refused_publishers_busy = 0, refused_publishers_limit = 0, refused_publishers_message = 0;
    std::uint64_t refused_viewers_no_stream = 0, refused_viewers_limit = 0, refused_viewers_message = 0;
    std::uint64_t slow_publishers = 0, slow_viewers = 0;  // whose messages took too long; so their connections ended
    std::uint64_t silent_publishers = 0;                  // whose connections were ended
    std::uint64_t dropped_for_memory = 0;                 // packets for which HubLimits leave no memory
    std::uint64_t gave_way = 0;                           // how often a stream did, since others needed its memory
    std::uint64_t joined = 0;                             // viewers who were let in
    std::map<std::string, std::uint64_t> closed{};        // connections that ended, by whose they were and why
    Histogram packet_time;                                // from a packet's arrival until it is taken for a viewer
    std::size_t memory = 0;                               // of all packets, those included that have come in part, now
};

// The publisher's clock, carried on by our own. What it tells is late by the time on the way, which varies: of the last
// few times the one that was least late counts.
class PublisherClock {
public:
    using Clock = Broadcast::Clock;
    void tell(std::int64_t clock_us, Clock::time_point now);
    void forget() { ahead_us_.clear(); }
    std::optional<std::int64_t> at(Clock::time_point now) const;

private:
    std::deque<std::int64_t> ahead_us_;  // of our clock
};

// Bounds how many text messages a connection may send: so many at once, and so many a second.
class TextAllowance {
public:
    using Clock = Broadcast::Clock;
    TextAllowance(double burst, double each_second) : burst_(burst), each_second_(each_second), left_(burst) {}
    // Whether one more is allowed; then it counts.
    bool allow(Clock::time_point now);

private:
    double burst_, each_second_, left_;
    Clock::time_point last_{};
};

// The end of a connection.
struct Closing {
    std::optional<CloseCode> code;  // none: the line is dead; nothing can be said
    std::string reason{};
    bool at_once = false;  // even if the other side has yet to take what is being written
};

// What to write to a connection next; monostate: nothing for now. After Closing nothing comes.
using ForPublisher = std::variant<std::monostate, Hello, HeartbeatToPublisher, KeyFrameRequest, Closing>;
using ForViewer = std::variant<std::monostate, SharedPacket, Hello, HeartbeatToViewer, Gone, Stamp, Closing>;

struct WatchOptions {
    bool texts = true;    // false: packets only, as in an endless body
    bool stamps = false;  // the publisher's stamps, before the packets that they are of
};

// Who is told what happens to the streams, at once.
struct HubListener {
    // A packet went to the viewers; those that nobody could decode do not.
    std::function<void(const std::string& stream, const SharedPacket& packet, Broadcast::Clock::time_point now)> sent{};
    std::function<void(const std::string& stream)> ended{};
    // Every packet that is new, whether it can be decoded or not. place: see Broadcast::push().
    std::function<void(const std::string& stream, std::uint64_t place, const SharedPacket& packet)> received{};
    // The stream gave memory back that others needed, and whoever holds what counts as its own does likewise.
    std::function<void(const std::string& stream)> gave_way{};
    // The publisher came, went, or began another session; the first viewer came, or the last one left; or it ended.
    std::function<void(const std::string& stream)> changed{};
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

    explicit Hub(const HubLimits& limits = {}, Log log = {})
        : limits_(limits), log_(std::move(log)), memory_(limits.memory, limits.stream_memory) {}

    // A connection that wants to publish under this name. wake: called when there is something for it to be written
    // after there was nothing. limit: there are too many streams. One that has not yet sent its first packet gives way
    // to a newer one of the same name.
    Result<Publisher> publish(const std::string& name, std::function<void()> wake, Clock::time_point now);
    // The publisher's next message: one packet. A damaged one is counted and left out. An error ends the connection,
    // which next() says too: the first packet is no sequence header, the stream belongs to another session that was
    // heard of lately, or there are too many streams.
    Result<void> receive_packet(Publisher publisher, std::vector<std::uint8_t> message, Clock::time_point now);
    // A text message. Likewise an error if it is none, too long, or one of too many.
    Result<void> receive_text(Publisher publisher, std::string_view text, Clock::time_point now);
    // What a text message said.
    void receive_text(Publisher publisher, const FromPublisher& message, Clock::time_point now);
    // A part of a message came, which takes so many bytes of memory by now, until it is whole:
    // receive_packet() or receive_text(). An error ends the connection: there is no memory for it.
    Result<void> receive_part(Publisher publisher, std::size_t bytes, Clock::time_point now);
    // What carries nothing, such as a ping, counts as a text message; an error if it is one of too many.
    Result<void> receive_nothing(Publisher publisher, Clock::time_point now);
    // The line is alive.
    void heard(Publisher publisher, Clock::time_point now);
    ForPublisher next(Publisher publisher);
    // The other side took leave, rather than that the line was lost: another session need not wait for it.
    void lets_go(Publisher publisher);
    // The connection ended. ended_stream: and so did the stream, as it does too where the publisher said so
    // (EndOfStream); its viewers are sent what waits for them, and their connections end. Otherwise it may come back.
    void leave(Publisher publisher, bool ended_stream, Clock::time_point now);

    // A stream whose publisher is connected to another hub (live/hub/hub_peering.h): it is listed and watched as those
    // of this hub are, and given what comes from there by receive_packet(); next() has what goes to that publisher. It
    // goes on with the stream even if a publisher is connected here, who is told. checksum: of its sequence header.
    // limit: there are too many streams.
    Result<Publisher> publish_from_afar(const std::string& name, std::uint32_t checksum, Clock::time_point now);
    // Whether that publisher is connected there, and which session it has begun.
    void tell_from_afar(Publisher publisher, bool published, std::optional<std::uint32_t> checksum,
                        Clock::time_point now);
    // How many watch the stream on other hubs.
    void tell_viewers_afar(const std::string& name, std::size_t viewers);
    // After a pause in which nobody watched and nothing was received: what comes next does not go on from there.
    void forget_packets(const std::string& name);
    // What another hub needs to go on with the stream, and the place of the packet that comes next. Nothing if there is
    // no such stream, or what is needed was too large to be kept.
    struct Closure {
        std::vector<Broadcast::Placed> packets;
        std::uint64_t next = 0;
    };
    std::optional<Closure> closure(const std::string& name) const;

    // bad_input: there is no such stream; limit: it has too many viewers. wake: as for publish().
    Result<Viewer> watch(const std::string& name, std::function<void()> wake, const WatchOptions& options,
                         Clock::time_point now);
    // As of a publisher.
    Result<void> receive_part(const Viewer& viewer, std::size_t bytes, Clock::time_point now);
    // A text message; an error ends the connection.
    Result<void> receive_text(const Viewer& viewer, std::string_view text, Clock::time_point now);
    Result<void> receive_nothing(const Viewer& viewer, Clock::time_point now);
    ForViewer next(const Viewer& viewer, Clock::time_point now);
    // Whether the connection ends without waiting for what is being written; wake is called when it comes to that.
    bool ends_at_once(const Viewer& viewer);
    void leave(const Viewer& viewer);

    // Heartbeats, silent publishers, and the end of streams that have been without a publisher for too long; to be
    // called ten times a second.
    void tick(Clock::time_point now);

    // Asks the publisher of the stream for a frame that can be decoded by itself, at once or as soon as it may be
    // asked again; unless such a frame comes before.
    void ask_for_key_frame(const std::string& name, Clock::time_point now);
    // It may ask for a key frame meanwhile, and must not change anything else.
    void listen(HubListener listener) { listeners_.push_back(std::move(listener)); }
    // Addresses of other hubs, for those who connect from now on.
    void name_other_hubs(std::vector<std::string> addresses) { other_hubs_ = std::move(addresses); }
    // Ends the connections of publishers, or all.
    void close_publishers(CloseCode code, const std::string& reason);
    void close_all(CloseCode code, const std::string& reason);

    // For what is made of a stream's packets and held, such as segments: it counts as the packets do.
    HubMemory::SharedShare share_of(const std::string& stream) { return memory_.share_of(stream); }
    // Whether the share may take so much more, if need be once those that hold more have given way.
    bool make_room(const HubMemory::Share& share, std::size_t bytes, Clock::time_point now);

    std::vector<StreamInfo> streams(Clock::time_point now) const;
    std::optional<StreamInfo> stream(const std::string& name, Clock::time_point now) const;
    HubCounters counters() const;
    const HubLimits& limits() const { return limits_; }
    // To the log, if there is one.
    void tell(const Event& event) const {
        if (log_) log_(event);
    }

private:
    // A message that has come in part.
    struct PartOfMessage {
        std::size_t bytes = 0;  // of memory; 0: there is none
        Clock::time_point since{};
    };
    struct Watching {
        std::function<void()> wake;
        WatchOptions options;
        TextAllowance allowance;
        bool hello = true, heartbeat = false, gone = false;  // to be written
        bool writing = false;                                // what next() gave
        PartOfMessage part{};
        Clock::time_point heartbeat_at{};  // the next one
        SharedPacket behind_stamp{};       // its stamp was written
        std::optional<Closing> closing{};
    };
    struct Stream {
        std::uint64_t number = 0;
        Broadcast broadcast;
        HubMemory::SharedShare share;
        std::optional<std::uint64_t> connection;  // of the publisher, one of connections_, if it was admitted
        bool alive_afar = false;                  // of a publisher on another hub: whether it is connected there
        std::size_t viewers_afar = 0;
        std::optional<std::uint32_t> checksum;  // of its sequence header
        std::optional<StreamInfo::Header> header{};
        Clock::time_point heard{};
        PublisherCounters counters;
        PublisherClock clock;
        std::optional<Clock::time_point> last_packet{}, last_heartbeat{};
        std::optional<Stamp> stamp{};  // of the frame that comes next
        bool has_frames = false;       // some of this session came
        bool wants_key_frame = false;  // once it may be asked for
        std::optional<Clock::time_point> asked_for_key_frame{};
        std::uint64_t key_frame_requests = 0;
        bool free = false;  // its publisher has let it go, and none has come since
        bool ended = false;
        std::string gone;  // why its publisher, or the stream, is gone
        std::map<Broadcast::Viewer, Watching> watching;
    };
    struct Connection {
        std::string stream;
        HubMemory::SharedShare share;
        std::function<void()> wake;
        TextAllowance allowance;
        Clock::time_point heard{};
        PartOfMessage part{};
        bool far = false;  // to another hub
        bool admitted = false;
        bool ends_stream = false;                                 // as the publisher said
        bool lets_go = false;                                     // likewise
        bool hello = true, heartbeat = false, key_frame = false;  // to be written
        Clock::time_point heartbeat_at{};
        std::optional<Closing> closing{};
    };
    static std::shared_ptr<LivePacket> counted(LivePacket packet, const HubMemory::SharedShare& share);
    void give_way(HubMemory::Share& share, Clock::time_point now);
    bool hold(PartOfMessage& part, HubMemory::Share& share, std::size_t bytes, Clock::time_point now);
    static void drop(PartOfMessage& part, HubMemory::Share& share);
    bool has_place_for(const std::string& name) const;
    Publisher connect(const std::string& name, std::function<void()> wake, Clock::time_point now);
    Stream& stream_named(const std::string& name);
    Stream* stream_of(const Viewer& viewer);
    Watching* watching(const Viewer& viewer);
    Stream* published_by(const Connection& connection);
    bool is_far(const Stream& stream) const;
    bool is_published(const Stream& stream) const;
    void changed(const std::string& name) const;
    void replace_publisher(Stream& stream, std::uint32_t checksum);
    static void forget_session(Stream& stream, std::uint32_t next_checksum);
    Result<void> admit(std::uint64_t number, Connection& connection, const PacketHeader& header, Clock::time_point now);
    Result<void> refuse(Connection& connection, const Error& error, CloseCode code);
    void count_close(const char* whose, const std::optional<Closing>& closing);
    void detach(Connection& connection, const std::string& why, Clock::time_point now);
    void begin_session(const std::string& name, Stream& stream, const PacketHeader& header,
                       std::span<const std::uint8_t> message);
    void ask_for_key_frame(Stream& stream, Clock::time_point now);
    void tell_gone(Stream& stream, const std::string& reason);
    void end_stream(std::map<std::string, Stream>::iterator stream, const std::string& reason);
    StreamInfo info(const std::string& name, const Stream& stream, Clock::time_point now) const;

    HubLimits limits_;
    Log log_;
    HubMemory memory_;
    std::map<std::string, Stream> streams_;
    std::map<std::uint64_t, Stream> ended_;  // by number: until their last viewers have been sent what waits
    std::map<std::uint64_t, Connection> connections_;
    std::uint64_t next_connection_ = 0, next_stream_ = 0;
    std::vector<std::string> other_hubs_;
    std::vector<HubListener> listeners_;
    HubCounters counters_;  // but for dropped_frames and fallen_behind of those who still watch
};

}  // namespace htvm::live
