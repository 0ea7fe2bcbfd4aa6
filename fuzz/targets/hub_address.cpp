// Addresses of hubs, which people type and hubs tell: what is taken has a host that can be looked up, and what is shown
// of it means the same.
#include "live/client/hub_address.h"

#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(reinterpret_cast<const char*>(data), size);
    const auto address = live::parse_hub_address(text);
    if (!address) {
        fuzz::require(!address.error().message.empty(), "what is wrong is said");
        return 0;
    }
    fuzz::require(live::looks_like_hub_address(text), "an address looks like one");
    fuzz::require(!address->host.empty() && address->port > 0 && address->target.starts_with('/'), "it is complete");
    for (const char c : address->host + address->target)
        fuzz::require(c > ' ' && c < 127, "a request cannot be split by what is in it");
    auto without_query = *address;
    without_query.target = without_query.target.substr(0, without_query.target.find('?'));
    const auto again = live::parse_hub_address(live::shown(*address));
    fuzz::require(again && *again == without_query, "what is shown is the same address");
    return 0;
}
