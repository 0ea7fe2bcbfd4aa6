// The hub's peering with hubs on other machines (live/hub/hub_peering.h) through NATS. NATS away, or slow, never holds
// up the server: what could not be sent or taken is lost and counted, and HubPeering asks again for what matters.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "htvm/result.hpp"
#include "live/hub/hub_peering.h"

namespace htvm::live {

struct NatsOptions {
    // nats:// or tls://[USER:PASSWORD@ or TOKEN@]HOST[:PORT]; several of nats://, separated by commas. "": no peering
    std::string servers;
    std::string ca_file;                   // certificates (PEM) to check the server's by, with TLS; "": the system's
    std::string credentials_file;          // of NATS's own accounts: a user's JWT and seed
    std::string hub_name;                  // of this hub, for people; "": the machine's
    std::string hub_url;                   // where viewers and publishers reach this hub, as others tell theirs
    std::chrono::milliseconds ping{1000};  // two that are not answered end the connection
    std::size_t most_waiting = std::size_t{64} << 20;  // bytes, in each direction
};

struct NatsCounters {
    HubPeeringCounters hubs;
    std::uint64_t connections = 0;    // made
    std::uint64_t slow_consumer = 0;  // how often NATS or its library dropped messages for us
    std::uint64_t dropped_to = 0;     // messages not sent: too many waited, or there was no connection
    std::uint64_t dropped_from = 0;   // messages not taken: too many waited
};

class NatsPeering {
public:
    // Connects, and goes on trying; the hub's log says when it has, and once why not. hub and context outlive it; the
    // hub is called on the thread that runs the context. bad_input if the servers are no addresses or a file cannot be
    // read; unsupported if this program was built without NATS.
    static Result<NatsPeering> open(const NatsOptions& options, Hub& hub, boost::asio::io_context& context);
    NatsPeering(NatsPeering&&) noexcept;
    NatsPeering& operator=(NatsPeering&&) noexcept;
    ~NatsPeering();

    // On the context's thread.
    NatsCounters counters() const;

private:
    struct State;
    explicit NatsPeering(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm::live
