#include "live/client/hub_address.h"

#include <algorithm>
#include <charconv>

#include "core/letter_case.h"

namespace htvm::live {
namespace {

constexpr std::string_view plain = "ws://", by_tls = "wss://";
constexpr std::string_view plain_web = "http://", web_by_tls = "https://";
constexpr std::uint16_t plain_port = 80, tls_port = 443;
constexpr std::size_t longest = 2048, longest_host = 253;

using internal::lower_case;

bool is_in_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == '_';
}

bool is_in_ipv6(char c) {
    return (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F') || (c >= '0' && c <= '9') || c == ':' || c == '.';
}

// What differs between the addresses of live streams and those of the web.
struct Schemes {
    std::string_view plain, by_tls, example;
};
constexpr Schemes live_schemes = {plain, by_tls, "a live stream's address is ws://HOST:PORT/PATH or wss://HOST/PATH"};
constexpr Schemes web_schemes = {plain_web, web_by_tls, "a web address is http://HOST:PORT/PATH or https://HOST/PATH"};

Result<HubAddress> parse_address(std::string_view text, const Schemes& schemes) {
    const auto wrong = [&](const std::string& what) {
        const auto query = text.find('?');  // not to be shown
        return fail(ErrorKind::bad_input, "'" + std::string(text.substr(0, std::min(query, longest))) + "' " + what +
                                              "; " + std::string(schemes.example));
    };
    if (std::any_of(text.begin(), text.end(), [](char c) { return c <= ' ' || c >= 127; }))
        return fail(ErrorKind::bad_input,
                    "an address has no spaces, control characters or letters beyond ASCII; write them as %XX");
    if (text.size() > longest) return fail(ErrorKind::bad_input, "an address has at most 2,048 characters");
    HubAddress out;
    const auto scheme_end = text.find("://");
    const auto scheme = lower_case(text.substr(0, scheme_end == std::string_view::npos ? 0 : scheme_end + 3));
    if (scheme != schemes.plain && scheme != schemes.by_tls)
        return wrong("does not begin with " + std::string(schemes.plain) + " or " + std::string(schemes.by_tls));
    out.secure = scheme == schemes.by_tls;
    out.port = out.secure ? tls_port : plain_port;
    auto rest = text.substr(scheme.size());
    if (rest.find('#') != std::string_view::npos) return wrong("has a #, which no server is sent");
    const auto target = std::min(rest.find_first_of("/?"), rest.size());
    out.target = rest.substr(target);
    if (!out.target.starts_with('/')) out.target.insert(0, 1, '/');
    rest = rest.substr(0, target);
    if (rest.find('@') != std::string_view::npos)
        return wrong("has a name or password before the host, which hubs do not know: give a token");
    std::string_view port;
    bool has_port = false;
    if (rest.starts_with('[')) {
        const auto end = rest.find(']');
        if (end == std::string_view::npos) return wrong("has a [ without a ]");
        out.host = rest.substr(1, end - 1);
        if (!std::all_of(out.host.begin(), out.host.end(), is_in_ipv6) || out.host.find(':') == std::string::npos)
            return wrong("has no IPv6 address between the brackets");
        rest = rest.substr(end + 1);
        has_port = rest.starts_with(':');
        if (!rest.empty() && !has_port) return wrong("goes on after the ] with neither port nor path");
        if (has_port) port = rest.substr(1);
    } else {
        const auto colon = std::min(rest.find(':'), rest.size());
        out.host = rest.substr(0, colon);
        if (!std::all_of(out.host.begin(), out.host.end(), is_in_name)) return wrong("has no valid host");
        has_port = colon < rest.size();
        if (has_port) port = rest.substr(colon + 1);
        if (port.find(':') != std::string_view::npos)
            return wrong("has several colons in its host; an IPv6 address stands in brackets, as in ws://[::1]:8080/");
    }
    if (out.host.empty()) return wrong("has no host");
    if (out.host.size() > longest_host) return wrong("has a host of more than 253 characters");
    if (!has_port) return out;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), out.port);
    if (error != std::errc() || end != port.data() + port.size() || out.port == 0)
        return wrong("has no port from 1 to 65535 behind the colon");
    return out;
}

// Without "." and "..", as paths are asked for (RFC 3986, section 5.2.4).
std::string without_dots(std::string_view path) {
    std::string out;
    for (std::size_t begin = 1; begin <= path.size();) {
        const auto end = std::min(path.find('/', begin), path.size());
        const auto part = path.substr(begin, end - begin);
        const bool last = end == path.size();
        if (part == "..") out.resize(out.empty() ? 0 : out.rfind('/'));
        if (part != "." && part != "..")
            out.append("/").append(part);
        else if (last)
            out += '/';
        begin = end + 1;
    }
    return out.empty() ? "/" : out;
}

}  // namespace

bool looks_like_hub_address(std::string_view text) { return text.find("://") != std::string_view::npos; }

bool looks_like_web_address(std::string_view text) {
    const auto beginning = lower_case(text.substr(0, web_by_tls.size()));
    return beginning.starts_with(plain_web) || beginning == web_by_tls;
}

Result<HubAddress> parse_hub_address(std::string_view text) { return parse_address(text, live_schemes); }

Result<HubAddress> parse_web_address(std::string_view text) { return parse_address(text, web_schemes); }

Result<HubAddress> resolved_reference(const HubAddress& base, std::string_view reference) {
    reference = reference.substr(0, reference.find('#'));
    const auto scheme = std::string(base.secure ? web_by_tls : plain_web);
    // A scheme is before the first of these.
    if (const auto at = reference.find_first_of(":/?"); at != std::string_view::npos && reference[at] == ':')
        return parse_web_address(reference);
    if (reference.starts_with("//")) return parse_web_address(scheme + std::string(reference.substr(2)));
    std::string target(reference);
    const auto path = base.target.substr(0, base.target.find('?'));
    if (reference.empty() || reference[0] == '?')
        target = path + target;
    else if (reference[0] != '/')
        target = path.substr(0, path.rfind('/') + 1) + target;
    const auto query = std::min(target.find('?'), target.size());
    return parse_web_address(scheme + host_header(base) + without_dots(target.substr(0, query)) + target.substr(query));
}

std::string host_header(const HubAddress& address) {
    const bool six = address.host.find(':') != std::string::npos;
    std::string out = six ? '[' + address.host + ']' : address.host;
    if (address.port != (address.secure ? tls_port : plain_port)) out += ':' + std::to_string(address.port);
    return out;
}

std::string shown(const HubAddress& address) {
    return std::string(address.secure ? by_tls : plain) + host_header(address) +
           address.target.substr(0, address.target.find('?'));
}

std::string web_text(const HubAddress& address) {
    return std::string(address.secure ? web_by_tls : plain_web) + host_header(address) + address.target;
}

std::string shown_web(const HubAddress& address) {
    const auto text = web_text(address);
    return text.substr(0, text.find('?'));
}

}  // namespace htvm::live
