// What a hub counts, for Prometheus: the text that it asks for at /metrics (text format 0.0.4). Counters begin with the
// program; the names are listed in docs/live.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "live/hub/hub.h"
#include "live/hub/nats_peering.h"
#include "live/server/authority.h"
#include "live/server/live_segments.h"
#include "live/server/recorder.h"
#include "live/server/traffic.h"

namespace htvm::live {

// The media type of the text.
inline constexpr const char* metrics_type = "text/plain; version=0.0.4; charset=utf-8";

struct MetricsSources {
    const Hub* hub = nullptr;                         // null: there are no live streams
    const Recorder* recorder = nullptr;               // null: nothing is recorded
    const LiveSegments* segments = nullptr;           // null: there are none of the live streams
    std::optional<NatsCounters> nats{};               // none: the hub is joined with no others
    const AuthorityCounters* authority = nullptr;     // null: there is none
    std::map<std::string, std::uint64_t> refused{};   // requests and connections, by cause; besides the hub's own
    const Traffic* traffic = nullptr;                 // null: not counted
    bool ready = true;                                // false: the server is ending
    unsigned connections = 0;                         // open now
    std::chrono::steady_clock::time_point started{};  // of the program
};
std::string metrics_text(const MetricsSources& sources, Hub::Clock::time_point now);

}  // namespace htvm::live
