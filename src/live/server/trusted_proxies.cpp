#include "live/server/trusted_proxies.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace htvm::live {
namespace {

namespace net = boost::asio;

// An IPv4 address may come as one of IPv6, as on a socket that listens for both.
net::ip::address plain(const net::ip::address& address) {
    if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address;
    return net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6());
}

std::optional<net::ip::address> read_address(std::string_view text) {
    constexpr std::size_t longest = 64;
    boost::system::error_code error;
    if (text.empty() || text.size() > longest) return std::nullopt;
    const auto address = net::ip::make_address(std::string(text), error);
    return error ? std::nullopt : std::optional(plain(address));
}

// As X-Forwarded-For has it, perhaps with a port: "192.0.2.1", "192.0.2.1:4711", "2001:db8::1", "[2001:db8::1]:4711".
std::optional<net::ip::address> read_forwarded(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    if (text.starts_with('[')) {
        const auto end = text.find(']');
        return end == std::string_view::npos ? std::nullopt : read_address(text.substr(1, end - 1));
    }
    if (std::count(text.begin(), text.end(), ':') == 1) text = text.substr(0, text.find(':'));
    return read_address(text);
}

// ---- The PROXY protocol ---------------------------------------------------------------------------------------------

constexpr std::array<std::uint8_t, 12> signature = {0x0d, 0x0a, 0x0d, 0x0a, 0x00, 0x0d,
                                                    0x0a, 0x51, 0x55, 0x49, 0x54, 0x0a};
constexpr std::string_view text_signature = "PROXY ";
constexpr std::size_t version_2_bytes = 16;  // before the addresses
constexpr std::size_t longest_text = 107, longest_header = 536;

std::string_view text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool is_binary(std::span<const std::uint8_t> bytes) {
    return bytes.size() >= signature.size() && std::equal(signature.begin(), signature.end(), bytes.begin());
}

std::size_t following_bytes(std::span<const std::uint8_t> bytes) { return std::size_t{bytes[14]} << 8 | bytes[15]; }

auto no_header() { return fail(ErrorKind::corrupt_stream, "it does not begin with a header of the PROXY protocol"); }

// "TCP4 192.0.2.1 192.0.2.2 4711 443"
Result<std::optional<net::ip::address>> read_text(std::string_view text) {
    std::vector<std::string_view> words;
    for (;;) {
        const auto end = text.find(' ');
        words.push_back(text.substr(0, end));
        if (end == std::string_view::npos) break;
        text.remove_prefix(end + 1);
    }
    if (words[0] == "UNKNOWN") return std::nullopt;
    const bool four = words[0] == "TCP4";
    if (words.size() != 5 || (!four && words[0] != "TCP6")) return no_header();
    boost::system::error_code error;
    const auto from = net::ip::make_address(std::string(words[1]), error);
    if (error || from.is_v4() != four) return no_header();
    return std::optional(plain(from));
}

Result<std::optional<net::ip::address>> read_binary(std::span<const std::uint8_t> bytes) {
    constexpr std::uint8_t of_proxy = 0x20, of_client = 0x21;
    constexpr int four = 1, six = 2;
    if (bytes[12] == of_proxy) return std::nullopt;
    if (bytes[12] != of_client) return no_header();
    const auto addresses = bytes.subspan(version_2_bytes);
    const int family = bytes[13] >> 4;
    if (family == four) {
        net::ip::address_v4::bytes_type from{};
        if (addresses.size() < 2 * from.size() + 4) return no_header();
        std::copy_n(addresses.begin(), from.size(), from.begin());
        return std::optional<net::ip::address>(net::ip::address_v4(from));
    }
    if (family == six) {
        net::ip::address_v6::bytes_type from{};
        if (addresses.size() < 2 * from.size() + 4) return no_header();
        std::copy_n(addresses.begin(), from.size(), from.begin());
        return std::optional(plain(net::ip::address_v6(from)));
    }
    return std::nullopt;
}

}  // namespace

Result<TrustedProxies> TrustedProxies::read(const std::vector<std::string>& networks) {
    TrustedProxies out;
    for (const auto& text : networks) {
        boost::system::error_code error;
        const bool whole = text.find('/') == std::string::npos;
        if (text.find(':') == std::string::npos) {
            const auto network = net::ip::make_network_v4(whole ? text + "/32" : text, error);
            if (!error) out.networks_.emplace_back(network.canonical());
        } else {
            const auto network = net::ip::make_network_v6(whole ? text + "/128" : text, error);
            if (!error) out.networks_.emplace_back(network.canonical());
        }
        if (error) return fail(ErrorKind::bad_input, text + " is no address or network, such as 10.0.0.0/8");
    }
    return out;
}

bool TrustedProxies::trusts(const net::ip::address& given) const {
    const auto address = plain(given);
    return std::any_of(networks_.begin(), networks_.end(), [&](const auto& network) {
        if (const auto* four = std::get_if<net::ip::network_v4>(&network))
            return address.is_v4() &&
                   net::ip::make_network_v4(address.to_v4(), four->prefix_length()).canonical() == *four;
        const auto& six = std::get<net::ip::network_v6>(network);
        return address.is_v6() && net::ip::make_network_v6(address.to_v6(), six.prefix_length()).canonical() == six;
    });
}

Client TrustedProxies::client_of(const Request& request, const Client& connected) const {
    if (!trusts(connected.address)) return connected;
    std::string all;
    const auto [first, last] = request.equal_range("X-Forwarded-For");
    for (auto field = first; field != last; ++field) all += (all.empty() ? "" : ",") + std::string(field->value());
    // Each proxy adds whom it was connected with: what stands before the first that is none may be anything.
    auto out = connected;
    std::string_view left = all;
    while (!left.empty() && trusts(out.address)) {
        const auto comma = left.rfind(',');
        const auto address = read_forwarded(comma == std::string_view::npos ? left : left.substr(comma + 1));
        if (!address) break;
        out = Client(*address, true);
        left = left.substr(0, comma == std::string_view::npos ? 0 : comma);
    }
    return out;
}

Result<std::size_t> proxy_header_needs(std::span<const std::uint8_t> bytes) {
    // The shortest header of version 1 is longer.
    if (bytes.size() < signature.size()) return signature.size() - bytes.size();
    if (is_binary(bytes)) {
        if (bytes.size() < version_2_bytes) return version_2_bytes - bytes.size();
        const auto whole = version_2_bytes + following_bytes(bytes);
        if (whole > longest_header || bytes.size() > whole) return no_header();
        return whole - bytes.size();
    }
    const auto text = text_of(bytes);
    if (!text.starts_with(text_signature) || text.size() > longest_text) return no_header();
    const auto end = text.find('\n');
    if (end == std::string_view::npos) return text.size() == longest_text ? no_header() : Result<std::size_t>(1);
    if (end + 1 != text.size()) return no_header();
    return 0;
}

Result<std::optional<net::ip::address>> read_proxy_header(std::span<const std::uint8_t> bytes) {
    const auto needed = proxy_header_needs(bytes);
    if (!needed || *needed > 0) return no_header();
    if (is_binary(bytes)) return read_binary(bytes);
    auto text = text_of(bytes).substr(text_signature.size());
    if (!text.ends_with("\r\n")) return no_header();
    text.remove_suffix(2);
    return read_text(text);
}

}  // namespace htvm::live
