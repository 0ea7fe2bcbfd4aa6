// Joins a hub with those of other machines (docs/live.md, "Many machines"). What is published on the others is listed
// and watched here as if it were published here; packets come over only while somebody watches. Where two
// publish under one name, the newer claim holds.
//
// There is no network here: it is given, and may lose, double and reorder what is sent (live/hub/nats_peering.h). All
// is called on the hub's thread.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "live/hub/far_stream.h"
#include "live/hub/hub.h"
#include "live/hub/hub_message.h"

namespace htvm::live {

struct HubPeeringOptions {
    std::string name;          // of this hub, for people
    std::string url;           // where viewers and publishers reach it, for their list of hubs; "": they are not told
    std::uint64_t number = 0;  // of this run of the hub; drawn at random
    FarStreamLimits far_stream{};
    std::chrono::milliseconds announce{1000};  // at least this often, and so often what is watched is asked for
    std::chrono::milliseconds silence{3000};   // after which a hub is taken for dead
    std::chrono::milliseconds withdrawn{
        1000};                               // after which a stream ends that its hub has no more, unless another has
    std::chrono::milliseconds wanted{5000};  // for how long packets go to a hub that asked for them
    std::chrono::milliseconds unwatched{5000};  // after which packets are not asked for any more
    std::function<std::int64_t()> system_time;  // microseconds since 1970; by default the system's clock
};

// What carries messages. Subjects are those of live/hub/hub_message.h.
struct HubNetwork {
    std::function<void(const std::string& subject, Bytes message)> send;
    std::function<void(const std::string&subject)> subscribe, unsubscribe;
};

struct HubPeeringCounters {
    bool connected = false;
    std::size_t hubs = 0;                               // others, that were heard of lately
    std::size_t far_streams = 0;                        // published on them
    std::size_t watched = 0;                            // of these, watched here
    std::size_t sent_streams = 0;                       // published here, and watched elsewhere
    std::uint64_t sent = 0;                             // messages
    std::uint64_t received = 0;                         // sound ones
    std::uint64_t unsent = 0;                           // messages lost since there was no connection
    std::uint64_t damaged = 0;                          // what was no message, or not what its sender may say
    std::uint64_t incomplete = 0;                       // messages of which parts did not come
    std::uint64_t packets = 0, bytes = 0;               // that came from afar and went on to viewers
    std::uint64_t gaps = 0, closures = 0, doubled = 0;  // as in FarStreamCounters
    std::uint64_t lost_claims = 0;                      // publishers here who lost their stream to one elsewhere
};

class HubPeering {
public:
    using Clock = Hub::Clock;

    // hub: outlives it.
    HubPeering(Hub& hub, const HubPeeringOptions& options, HubNetwork network);
    HubPeering(const HubPeering&) = delete;
    HubPeering& operator=(const HubPeering&) = delete;

    // The subjects that it hears whether anything is watched or not.
    std::vector<std::string> subjects() const { return {announcements_subject(), hub_subject(options_.number)}; }
    void connected(Clock::time_point now);
    void disconnected(Clock::time_point now);
    void receive(const std::string& subject, std::span<const std::uint8_t> part, Clock::time_point now);
    // To be called about fifty times a second.
    void tick(Clock::time_point now);

    HubPeeringCounters counters() const;

private:
    struct Wanted {
        Clock::time_point until{}, answered{};
        std::uint32_t viewers = 0;
    };
    // A stream that is published here.
    struct Own {
        Claim claim;
        std::uint64_t connection = 0;              // the publisher's
        std::map<std::uint64_t, Wanted> wanted{};  // by hub
    };
    struct OtherHub {
        std::string url;
        Clock::time_point heard{};
        std::map<std::string, AnnouncedStream> streams;
    };
    // A stream that is published there.
    struct Far {
        Claim claim;
        Hub::Publisher publisher;
        std::optional<FarStream> stream{};  // while it is watched
        std::optional<Clock::time_point> unwatched_since{}, withdrawn_since{}, asked{};
        bool silent = false;     // withdrawn since its hub fell silent
        bool key_frame = false;  // to be asked for
    };
    struct Newest {
        Claim claim;
        const AnnouncedStream* stream = nullptr;
    };

    void hear(const Announcement& message, std::uint64_t hub, Clock::time_point now);
    void hear(StreamRequest message, std::uint64_t hub, Clock::time_point now);
    Newest newest_claim(const std::string& name) const;
    void settle(const std::string& name, Clock::time_point now);
    void follow(const std::string& name, const Newest& newest, Clock::time_point now);
    void stream_changed(const std::string& name);
    void packet_received(const std::string& name, std::uint64_t place, const SharedPacket& packet);
    void watch(const std::string& name, Far& far, Clock::time_point now);
    void stop_watching(const std::string& name, Far& far);
    void ask(const std::string& name, Far& far, bool closure, Clock::time_point now);
    void tick(const std::string& name, Far& far, Clock::time_point now);
    void forget_silent_hubs(Clock::time_point now);
    void announce(Clock::time_point now);
    void name_hubs();
    void count_viewers(const std::string& name, const Own& own);
    void send(const std::string& subject, const HubMessage& message);

    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    Hub& hub_;
    HubPeeringOptions options_;
    HubNetwork network_;
    PartReader parts_;
    bool connected_ = false;
    std::map<std::uint64_t, OtherHub> others_;
    std::map<std::string, Own> own_;
    std::map<std::string, Far> far_;
    std::map<std::string, Claim> held_;     // the last that held of each stream, while it is known here
    std::vector<Hub::Publisher> replaced_;  // by publishers here
    Clock::time_point now_{};               // of the last call
    std::optional<Clock::time_point> announced_;
    bool announce_soon_ = false;
    std::uint64_t next_message_ = 0;
    HubPeeringCounters counters_;  // sums; without what streams count that are watched
};

}  // namespace htvm::live
