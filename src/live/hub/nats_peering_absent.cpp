// In place of nats_peering.cpp where there is no libnats.
#include "live/hub/nats_peering.h"

namespace htvm::live {

struct NatsPeering::State {};

Result<NatsPeering> NatsPeering::open(const NatsOptions&, Hub&, boost::asio::io_context&) {
    return fail(ErrorKind::unsupported,
                "this htvm was built without NATS, so it cannot join other hubs: leave out --nats and HTVM_NATS, or "
                "install libnats-dev and build it again with -DHTVM_NATS=ON");
}

NatsPeering::NatsPeering(std::unique_ptr<State> state) : state_(std::move(state)) {}
NatsPeering::NatsPeering(NatsPeering&&) noexcept = default;
NatsPeering& NatsPeering::operator=(NatsPeering&&) noexcept = default;
NatsPeering::~NatsPeering() = default;

NatsCounters NatsPeering::counters() const { return {}; }

}  // namespace htvm::live
