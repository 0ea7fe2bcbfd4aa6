// In place of nats_link.cpp where there is no libnats.
#include "live/nats_link.h"

namespace htvm::live {

struct NatsLink::State {};

Result<NatsLink> NatsLink::open(const NatsOptions&, Hub&, boost::asio::io_context&) {
    return fail(ErrorKind::unsupported, "this htvm was built without NATS (libnats-dev)");
}

NatsLink::NatsLink(std::unique_ptr<State> state) : state_(std::move(state)) {}
NatsLink::NatsLink(NatsLink&&) noexcept = default;
NatsLink& NatsLink::operator=(NatsLink&&) noexcept = default;
NatsLink::~NatsLink() = default;

NatsCounters NatsLink::counters() const { return {}; }

bool has_nats() { return false; }

}  // namespace htvm::live
