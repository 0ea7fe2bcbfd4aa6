// One live stream on its way from its publisher to its viewers. A late viewer is sent what the newest frame needs, then
// everything as it comes. What waits for a slow viewer is bounded, so it neither delays the others nor takes memory:
// it is dropped up to the next frame that needs little, and counted. What a viewer is sent can always be decoded.
// Pictures of textures are dropped first, up to the next key picture: the meshes go on, wearing the last one.
//
// Only headers are read (docs/bitstream.md, section 2.2), and there is no network here: a server pushes packets in, and
// takes for each viewer the next packet to write.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "htvm/dependency.hpp"
#include "htvm/packet.hpp"
#include "live/client/control.h"

namespace htvm::live {

// A packet as it stands in a file, shared by the viewers.
struct LivePacket {
    PacketHeader header;  // as header_with_flags() has it
    std::vector<std::uint8_t> bytes;
    std::optional<Stamp> stamp{};  // for measurement

    bool is_frame() const;
    bool is_picture() const { return header.kind == PacketKind::texture; }
    // Whether it is the reference of the frames that follow.
    bool is_reference() const;
    // Whether it and what follows can be decoded by whoever has the reference, without the T-frames before it.
    bool is_access() const;
};
using SharedPacket = std::shared_ptr<const LivePacket>;
// The packet, which must be whole, taken apart.
Packet packet_of(const LivePacket& packet);

struct BroadcastLimits {
    // How much may wait for one viewer, besides what the kernel has taken:
    std::size_t bytes = std::size_t{1} << 20;
    std::chrono::milliseconds wait{2000};  // from a packet's arrival until it is taken
    std::size_t most_missed = 4;           // frames sent belatedly so that a viewer can follow again, references not
                                           // counted; where more are missing, it waits for a frame that needs fewer
    // How much is kept for those who may still join. If frames since the last I-frame are more, they must wait for the
    // next one; those who watch are not affected.
    std::size_t kept_bytes = std::size_t{64} << 20;
    // How many packets later frames may need. Each packet takes time by how many there are: what comes beyond is
    // taken for undecodable, up to the next I-frame.
    std::size_t kept_packets = 1024;
};

struct ViewerCounters {
    std::uint64_t packets = 0, bytes = 0;  // taken to be written
    std::uint64_t dropped_frames = 0;
    std::uint64_t dropped_pictures = 0;  // of textures: the meshes come without them
    std::uint64_t fallen_behind = 0;     // how often
};

class Broadcast {
public:
    using Clock = std::chrono::steady_clock;
    using Viewer = std::uint64_t;

    explicit Broadcast(const BroadcastLimits& limits = {}) : limits_(limits) {}

    // The publisher's next packet. Indexes, which speak of a file, go no further, nor do frames that no viewer could
    // decode, since what they refer to did not come; nor does what is kept already, as a publisher sends it again who
    // comes back. Returns the packet's place, which ascends by one, if it was taken.
    std::optional<std::uint64_t> push(SharedPacket packet, Clock::time_point now);

    // wake: called when packets wait for the viewer again after none did.
    Viewer join(std::function<void()> wake, Clock::time_point now);
    void leave(Viewer viewer) { viewers_.erase(viewer); }
    // The next packet to write for this viewer; null if none waits.
    SharedPacket next(Viewer viewer);

    std::size_t viewers() const { return viewers_.size(); }
    const ViewerCounters& counters(Viewer viewer) const { return viewers_.at(viewer).counters; }
    std::size_t waiting_bytes(Viewer viewer) const { return viewers_.at(viewer).bytes; }
    // For how long the next packet for it has waited.
    Clock::duration waiting_time(Viewer viewer, Clock::time_point now) const;
    // Whether it was given all that later frames may need; otherwise, once there are frames, it waits for one that
    // needs little.
    bool follows(Viewer viewer) const { return viewers_.at(viewer).in_step; }
    std::uint64_t undecodable_frames() const { return undecodable_; }
    // Memory held for viewers who may still join.
    std::size_t kept_bytes() const;

    // What a viewer who came now would be sent, in the order in which to decode it. Nothing if it was too large to be
    // kept.
    struct Placed {
        std::uint64_t place;
        SharedPacket packet;
    };
    std::optional<std::vector<Placed>> kept() const;
    std::uint64_t next_place() const { return next_place_; }
    // Frees what is kept for those who may still join: they wait for the next I-frame. Those who watch are not
    // affected, unless something waits for them.
    void drop_kept() { forget_all_but({}); }
    // Begins anew, as after a pause in which nothing was pushed. Those who watch wait for the next frame.
    void forget();

private:
    struct Waiting {
        std::uint64_t place;
        SharedPacket packet;
        Clock::time_point arrived;
    };
    struct Queue {
        std::function<void()> wake{};
        std::deque<Waiting> waiting{};
        std::size_t bytes = 0;             // of what waits
        bool in_step = false;              // it was given all that later frames may need
        bool joining = true;               // it was not given a frame yet
        bool pictures = false;             // it was given all pictures that the next one may need
        std::vector<std::uint64_t> has{};  // if not in step: which of kept_ it was sent, ascending
        ViewerCounters counters{};
    };
    bool fits(const Queue& queue, const LivePacket& packet, Clock::time_point now) const;
    void give(Queue& queue, std::uint64_t place, Clock::time_point now);
    void give_in_step(Queue& queue, std::uint64_t place, Clock::time_point now);
    void give_picture(Queue& queue, std::uint64_t place, Clock::time_point now);
    void drop_pictures(Queue& queue);
    void fall_behind(Queue& queue, std::uint64_t place);
    void try_to_follow(Queue& queue, Clock::time_point now);
    bool is_kept(const LivePacket& packet) const;
    bool is_picture(std::uint64_t place) const;
    bool has_all_pictures() const;
    void forget_all_but(const std::vector<std::uint64_t>& needed);

    BroadcastLimits limits_;
    Dependencies dependencies_;
    std::map<std::uint64_t, SharedPacket>
        packets_;  // by place: those of kept_ and closure_, unless they were too large
    // Ascending: what later frames may need, and what the newest frame needs; empty if that cannot be decoded.
    std::vector<std::uint64_t> kept_, closure_;
    std::vector<std::uint64_t> kept_pictures_;  // those of kept_ that are pictures; where they are too many, not in
                                                // packets_
    std::map<Viewer, Queue> viewers_;
    Viewer next_viewer_ = 0;
    std::uint64_t undecodable_ = 0, next_place_ = 0;
};

}  // namespace htvm::live
