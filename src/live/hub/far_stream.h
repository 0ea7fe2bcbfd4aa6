// A stream that another hub has the publisher of, put together from what that hub's messages bring. What is given on is
// exactly the publisher's packets, each once and in order; where some were lost, the closure of the newest frame is
// asked for, and of that, what is missing goes on. So whoever was given all before it can decode what comes after.
#pragma once

#include <chrono>
#include <map>
#include <optional>

#include "live/hub/hub_message.h"

namespace htvm::live {

struct FarStreamLimits {
    std::size_t held_bytes = std::size_t{32} << 20;  // packets that wait for those before them; the oldest go first
    std::chrono::milliseconds ask_again{300};        // if the closure did not come
    std::chrono::milliseconds overdue{200};          // a packet that was announced and did not come
};

struct FarStreamCounters {
    std::uint64_t packets = 0, bytes = 0;  // given on
    std::uint64_t gaps = 0;                // how often packets were missing
    std::uint64_t closures = 0;            // taken, on joining too
    std::uint64_t doubled = 0;             // packets that had come already
};

class FarStream {
public:
    using Clock = std::chrono::steady_clock;

    // At first it has nothing, and asks.
    explicit FarStream(const Claim& claim, const FarStreamLimits& limits = {}) : claim_(claim), limits_(limits) {}

    // Each gives the packets that can go on now. Those of another claim are passed over.
    std::vector<Bytes> receive(PublishedPacket message);
    std::vector<Bytes> receive(ClosureAnswer message);
    // The publisher's hub says which packet comes next.
    void announced(std::uint64_t next, Clock::time_point now);
    // Messages were lost, perhaps, and nothing that comes may tell.
    void doubt() { lacking_ = true, asked_.reset(); }
    // Whether to ask for the closure now.
    bool asks(Clock::time_point now);

    const Claim& claim() const { return claim_; }
    const FarStreamCounters& counters() const { return counters_; }

private:
    void give(Bytes bytes, std::vector<Bytes>& out);
    void give_held(std::vector<Bytes>& out);

    Claim claim_;
    FarStreamLimits limits_;
    std::optional<std::uint64_t> next_;  // the packet to give on next; nothing before the first closure
    std::map<std::uint64_t, Bytes> held_;
    std::size_t held_bytes_ = 0;
    bool lacking_ = true;
    std::optional<Clock::time_point> asked_;
    std::uint64_t announced_ = 0;
    std::optional<Clock::time_point> behind_since_;  // behind what was announced
    FarStreamCounters counters_;
};

}  // namespace htvm::live
