// Who is behind a connection. Web servers and load balancers before the hub say it, by the PROXY protocol or in a
// header; they are believed only if they are known, since anybody can say such things.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/network_v4.hpp>
#include <boost/asio/ip/network_v6.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "htvm/result.hpp"
#include "live/files/http_request.h"

namespace htvm::live {

struct Client {
    boost::asio::ip::address address;
    bool by_proxy = false;  // as a proxy said it: then it is no program on this machine, wherever it is
    // Whoever connects is a client, unless something else is known.
    Client(boost::asio::ip::address given, bool proxy = false) : address(std::move(given)), by_proxy(proxy) {}
};

class TrustedProxies {
public:
    // None.
    TrustedProxies() = default;
    // Addresses and networks: "10.0.0.7", "fd00::/8". bad_input if one is neither.
    static Result<TrustedProxies> read(const std::vector<std::string>& networks);

    bool trusts(const boost::asio::ip::address& address) const;
    // Who a request is from that came over this connection: the last one in X-Forwarded-For that is no proxy itself, if
    // a proxy sent it; else whoever connected.
    Client client_of(const Request& request, const Client& connected) const;

private:
    std::vector<std::variant<boost::asio::ip::network_v4, boost::asio::ip::network_v6>> networks_;
};

// ---- The PROXY protocol, versions 1 and 2 ---------------------------------------------------------------------------

// How many bytes of the header have to come besides these, at least; 0: these are all of it. corrupt_stream if they
// are no such header, or one of more than 536 bytes. What is behind the header never counts as needed.
Result<std::size_t> proxy_header_needs(std::span<const std::uint8_t> bytes);
// Whom a whole header names; nothing if that is the proxy itself (LOCAL, UNKNOWN), or no address of the Internet.
// corrupt_stream if it is not as it should be.
Result<std::optional<boost::asio::ip::address>> read_proxy_header(std::span<const std::uint8_t> bytes);

}  // namespace htvm::live
