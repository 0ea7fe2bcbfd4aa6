// In place of nats_link.cpp where there is no libnats.
#include "live/hub/nats_link.h"

namespace htvm::live {

struct NatsLink::State {};

Result<NatsLink> NatsLink::open(const NatsOptions&, Hub&, boost::asio::io_context&) {
    return fail(ErrorKind::unsupported,
                "this htvm was built without NATS, so it cannot join other hubs: leave out --nats and HTVM_NATS, or "
                "install libnats-dev and build it again with -DHTVM_NATS=ON");
}

NatsLink::NatsLink(std::unique_ptr<State> state) : state_(std::move(state)) {}
NatsLink::NatsLink(NatsLink&&) noexcept = default;
NatsLink& NatsLink::operator=(NatsLink&&) noexcept = default;
NatsLink::~NatsLink() = default;

NatsCounters NatsLink::counters() const { return {}; }

}  // namespace htvm::live
