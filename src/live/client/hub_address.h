// Where a hub or a web server is: the addresses that people type, those that hubs tell of each other, and those that
// playlists have.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "htvm/result.hpp"

namespace htvm::live {

struct HubAddress {
    bool secure = false;  // wss or https: by TLS
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

// Whether it begins with http:// or https://.
bool looks_like_web_address(std::string_view text);
// Likewise of http:// and https://.
Result<HubAddress> parse_web_address(std::string_view text);
// Where a reference leads that a file at `base` has: an address, or one without scheme and host, a path from the root
// or from where the file is. What comes behind a # is left out. bad_input if that is no address of http or https.
Result<HubAddress> resolved_reference(const HubAddress& base, std::string_view reference);

// For people: without the query, where tokens and signatures are.
std::string shown(const HubAddress& address);
std::string shown_web(const HubAddress& address);  // as http or https
// All of it, as http or https.
std::string web_text(const HubAddress& address);

// HOST[:PORT] as the header Host has it.
std::string host_header(const HubAddress& address);

}  // namespace htvm::live
