// What answers requests, once routing.h has said which handler. Each asks Admission whether it may. Some send one
// response, and the connection goes on; those for live streams have the connection to its end.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/thread_pool.hpp>
#include <chrono>

#include "live/client/line.h"
#include "live/files/http_request.h"
#include "live/files/player_pages.h"
#include "live/files/response.h"
#include "live/files/routing.h"
#include "live/files/served_files.h"
#include "live/hub/hub.h"
#include "live/hub/nats_peering.h"
#include "live/server/admission.h"
#include "live/server/authority.h"
#include "live/server/live_segments.h"
#include "live/server/recorder.h"
#include "live/server/refusals.h"
#include "live/server/shared_text.h"
#include "live/server/traffic.h"
#include "live/server/trusted_proxies.h"

namespace htvm::live {

struct Site;

// The texts that take work and that anybody may ask for, of a site. They must live until every answer has come.
struct SharedTexts {
    SharedText streams, metrics, files;
    boost::asio::thread_pool walker{1};  // of the folder of files: it ends first
    SharedTexts(const Site& site, const boost::asio::any_io_executor& executor);
};

// What the handlers answer from. They change nothing of it but what is called or counted: admission, refusals, traffic
// and the hub.
struct Site {
    Admission& admission;
    Refusals& refusals;
    Traffic& traffic;
    TrustedProxies proxies{};
    bool proxy_protocol = false;  // the proxies' connections begin with a header of the PROXY protocol
    Log access{};                 // of every request; empty: none
    ServedFiles files{};
    PlayerPages pages{};
    Hub* hub = nullptr;                  // null: there are no live streams
    const Recorder* recorder = nullptr;  // null: nothing is recorded
    LiveSegments* segments = nullptr;    // null: there are none of the live streams
    const NatsPeering* nats = nullptr;   // null: the hub is joined with no others
    Authority* authority = nullptr;      // null: there is none
    SharedTexts* texts = nullptr;        // never null once somebody asks
    std::chrono::seconds stall_time{};   // for a client to take the next 64 KB of a response
    Hub::Clock::time_point started = Hub::Clock::now();
    bool ending = false;  // the server is
};

// The response to a request for which there is no live stream to be carried.
boost::asio::awaitable<Response> answer(const Site& site, const Route& route, const Request& request,
                                        const Client& client);

// What the authority says of what is refused otherwise, where it may be asked: nothing if it lets it be. action:
// publish or watch.
boost::asio::awaitable<std::optional<Refusal>> ask_authority(const Site& site, const char* action,
                                                             const std::string& stream, const Request& request,
                                                             const Client& client, Refusal otherwise);

// Publishes or watches, or says why not; then the connection has ended. route: a live one. has_place: whether the
// client may have another connection.
boost::asio::awaitable<void> carry(const Site& site, Line line, Request request, Route route, Client client,
                                   bool has_place);

}  // namespace htvm::live
