// What comes before everything else on a proxy's connection, and whom it names in its requests.
#include "fuzz_input.h"
#include "live/server/trusted_proxies.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::span<const std::uint8_t> all(data, size);
    // As a connection reads it: never more than is needed.
    std::size_t read = 0;
    for (;;) {
        const auto needed = live::proxy_header_needs(all.first(read));
        if (!needed) break;
        fuzz::require(read + *needed <= 536, "a header is short");
        if (*needed == 0 || read + *needed > size) break;
        read += *needed;
    }
    const auto named = live::read_proxy_header(all.first(read));
    if (named && *named) fuzz::require(read >= 16, "an address takes bytes");
    static const auto proxies = live::TrustedProxies::read({"10.0.0.0/8", "fd00::/8"});
    live::Request request;
    const std::string text(data, data + size);
    if (text.find_first_of(std::string_view("\r\n\0", 3)) == std::string::npos) request.set("X-Forwarded-For", text);
    const auto client = proxies->client_of(request, boost::asio::ip::make_address("10.0.0.1"));
    fuzz::require(client.by_proxy || client.address.to_string() == "10.0.0.1", "a proxy names somebody, or is itself");
    return 0;
}
