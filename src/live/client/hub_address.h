// Where a hub is: the addresses that people type, and those that hubs tell of each other.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "htvm/result.hpp"

namespace htvm::live {

struct HubAddress {
    bool secure = false;  // wss: by TLS
    std::string host;     // a name or an IP address; IPv6 without brackets
    std::uint16_t port = 80;
    std::string target = "/";  // path and query, as it is requested
    bool operator==(const HubAddress&) const = default;
};

// Whether this is meant as an address rather than as the name of a file.
bool looks_like_hub_address(std::string_view text);

// ws://HOST[:PORT][/PATH][?QUERY], or wss. bad_input, with what is wrong, for anything else: other schemes, names and
// passwords, ports beyond 1 to 65535, spaces and control characters, more than 2,048 characters.
Result<HubAddress> parse_hub_address(std::string_view text);

// For people: without the query, where tokens and signatures are.
std::string shown(const HubAddress& address);

// HOST[:PORT] as the header Host has it.
std::string host_header(const HubAddress& address);

}  // namespace htvm::live
