// Who is behind a connection: headers of the PROXY protocol, X-Forwarded-For, and whom they are believed of.
#include "live/server/trusted_proxies.h"

#include <gtest/gtest.h>

#include <string>

namespace htvm::live {
namespace {

namespace net = boost::asio;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
// The address; "itself" where the proxy names nobody; "none" where it is no header.
std::string named(const std::string& header) {
    const auto read = read_proxy_header(bytes_of(header));
    if (!read) return "none";
    return *read ? (*read)->to_string() : "itself";
}
std::string binary(char command, char family, const std::string& addresses) {
    std::string out("\r\n\r\n\0\r\nQUIT\n", 12);
    for (const char c :
         {command, family, static_cast<char>(addresses.size() >> 8), static_cast<char>(addresses.size() & 255)})
        out.push_back(c);
    return out.append(addresses);
}
const std::string loopback_six = [] {
    std::string out(36, '\0');
    out[15] = '\x01';
    return out;
}();
const std::string four("\xc0\x00\x02\x01\xc0\x00\x02\x09\x12\x67\x00\x50", 12);

TEST(ProxyHeader, TextNamesTheClient) {
    EXPECT_EQ(named("PROXY TCP4 192.0.2.1 192.0.2.9 4711 80\r\n"), "192.0.2.1");
    EXPECT_EQ(named("PROXY TCP6 2001:db8::1 2001:db8::9 4711 80\r\n"), "2001:db8::1");
    EXPECT_EQ(named("PROXY UNKNOWN\r\n"), "itself");
    EXPECT_EQ(named("PROXY UNKNOWN anything at all\r\n"), "itself");
    for (const char* wrong : {"PROXY TCP4 2001:db8::1 192.0.2.9 4711 80\r\n", "PROXY TCP4 192.0.2.1\r\n",
                              "PROXY TCP5 192.0.2.1 192.0.2.9 4711 80\r\n", "PROXY TCP4 192.0.2.1 192.0.2.9 4711 80\n",
                              "GET / HTTP/1.1\r\n", ""})
        EXPECT_EQ(named(wrong), "none") << wrong;
}

TEST(ProxyHeader, BytesNameTheClient) {
    EXPECT_EQ(named(binary('\x21', '\x11', four)), "192.0.2.1");
    EXPECT_EQ(named(binary('\x21', '\x11', four + "more")), "192.0.2.1");
    EXPECT_EQ(named(binary('\x21', '\x21', loopback_six)), "::1");
    EXPECT_EQ(named(binary('\x20', '\x00', "")), "itself");
    EXPECT_EQ(named(binary('\x21', '\x31', std::string(216, 'x'))), "itself") << "a socket of the file system";
    EXPECT_EQ(named(binary('\x21', '\x11', four.substr(1))), "none");
    EXPECT_EQ(named(binary('\x22', '\x11', four)), "none");
    EXPECT_EQ(named(binary('\x21', '\x11', std::string(600, 'x'))), "none") << "too long";
}

TEST(ProxyHeader, IsReadWithoutAByteOfWhatIsBehindIt) {
    for (const auto& header :
         {std::string("PROXY TCP4 192.0.2.1 192.0.2.9 4711 80\r\n"), binary('\x21', '\x11', four)}) {
        std::string read;
        for (;;) {
            const auto needed = proxy_header_needs(bytes_of(read));
            ASSERT_TRUE(needed);
            if (*needed == 0) break;
            ASSERT_LE(read.size() + *needed, header.size());
            read = header.substr(0, read.size() + *needed);
        }
        EXPECT_EQ(read, header);
    }
    EXPECT_FALSE(proxy_header_needs(bytes_of("GET / HTTP/1.1\r\n")));
    EXPECT_FALSE(proxy_header_needs(bytes_of("PROXY " + std::string(101, 'x'))));
}

std::string client(const std::string& from, const std::string& forwarded,
                   const std::vector<std::string>& trusted = {"10.0.0.0/8", "fd00::/8"}) {
    Request request;
    if (!forwarded.empty()) request.set("X-Forwarded-For", forwarded);
    const auto proxies = TrustedProxies::read(trusted);
    const auto out = proxies->client_of(request, net::ip::make_address(from));
    return out.address.to_string() + (out.by_proxy ? " by proxy" : "");
}

TEST(TrustedProxies, AreBelievedWhomTheyNameAndNobodyElseIs) {
    EXPECT_EQ(client("10.1.2.3", "192.0.2.1"), "192.0.2.1 by proxy");
    EXPECT_EQ(client("::ffff:10.1.2.3", "192.0.2.1:4711"), "192.0.2.1 by proxy");
    EXPECT_EQ(client("fd00::1", "[2001:db8::1]:4711"), "2001:db8::1 by proxy");
    EXPECT_EQ(client("fd00::1", "2001:db8::1"), "2001:db8::1 by proxy");
    EXPECT_EQ(client("192.0.2.5", "192.0.2.1"), "192.0.2.5");
    EXPECT_EQ(client("10.1.2.3", ""), "10.1.2.3");
    EXPECT_EQ(client("10.1.2.3", "unknown"), "10.1.2.3");
    EXPECT_EQ(client("10.1.2.3", "192.0.2.1", {}), "10.1.2.3");
}

TEST(TrustedProxies, WhatAClientSaysOfItselfIsNotBelieved) {
    EXPECT_EQ(client("10.1.2.3", "198.51.100.1, 192.0.2.1"), "192.0.2.1 by proxy");
    EXPECT_EQ(client("10.1.2.3", "198.51.100.1, 192.0.2.1, 10.9.9.9"), "192.0.2.1 by proxy");
    EXPECT_EQ(client("10.1.2.3", "198.51.100.1, nobody, 10.9.9.9"), "10.9.9.9 by proxy");
}

TEST(TrustedProxies, AreAddressesAndNetworks) {
    EXPECT_TRUE(TrustedProxies::read({"10.0.0.7", "fd00::/8", "0.0.0.0/0"}));
    for (const char* wrong : {"hub.example", "10.0.0.0/33", "10.0.0.0/", "", "fd00::/129"})
        EXPECT_FALSE(TrustedProxies::read({wrong})) << wrong;
}

}  // namespace
}  // namespace htvm::live
