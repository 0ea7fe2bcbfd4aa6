#include "live/client/hub_address.h"

#include <gtest/gtest.h>

namespace htvm::live {
namespace {

std::string complaint(const std::string& text) {
    const auto address = parse_hub_address(text);
    return address ? "" : address.error().message;
}

TEST(HubAddress, HasHostPortAndPath) {
    EXPECT_EQ(parse_hub_address("ws://hub.example:8080/publish/anna").value(),
              (HubAddress{false, "hub.example", 8080, "/publish/anna"}));
}

TEST(HubAddress, ThePortIsThatOfTheWebUnlessGiven) {
    EXPECT_EQ(parse_hub_address("ws://hub/watch/anna").value().port, 80);
    EXPECT_EQ(parse_hub_address("WSS://hub").value(), (HubAddress{true, "hub", 443, "/"}));
}

TEST(HubAddress, AnIPv6AddressStandsInBrackets) {
    EXPECT_EQ(parse_hub_address("ws://[::1]:9000/watch/a").value(), (HubAddress{false, "::1", 9000, "/watch/a"}));
    EXPECT_EQ(host_header({false, "::1", 9000, "/"}), "[::1]:9000");
    EXPECT_NE(complaint("ws://::1/watch/a").find("brackets"), std::string::npos);
    EXPECT_NE(complaint("ws://[hub]/").find("IPv6"), std::string::npos);
    EXPECT_NE(complaint("ws://[::1").find("]"), std::string::npos);
}

TEST(HubAddress, WhatIsShownLeavesTokensOut) {
    EXPECT_EQ(shown(parse_hub_address("wss://hub:443/publish/a?token=secret").value()), "wss://hub/publish/a");
    EXPECT_EQ(complaint("http://hub/publish/a?token=secret").find("secret"), std::string::npos);
}

TEST(HubAddress, SaysWhatIsWrong) {
    EXPECT_NE(complaint("http://hub/").find("does not begin with ws://"), std::string::npos);
    EXPECT_NE(complaint("ws:///publish").find("no host"), std::string::npos);
    EXPECT_NE(complaint("ws://hub:0/").find("1 to 65535"), std::string::npos);
    EXPECT_NE(complaint("ws://hub:65536/").find("1 to 65535"), std::string::npos);
    EXPECT_NE(complaint("ws://hub:/").find("1 to 65535"), std::string::npos);
    EXPECT_NE(complaint("ws://me:pw@hub/").find("token"), std::string::npos);
    EXPECT_NE(complaint("ws://hub/a\r\nHost: b").find("control characters"), std::string::npos);
    EXPECT_NE(complaint("ws://hub/#a").find("#"), std::string::npos);
    EXPECT_NE(complaint("ws://" + std::string(3000, 'a')).find("2,048"), std::string::npos);
}

TEST(HubAddress, FilesDoNotLookLikeIt) {
    EXPECT_TRUE(looks_like_hub_address("http://hub/a"));
    EXPECT_FALSE(looks_like_hub_address("ws"));
    EXPECT_FALSE(looks_like_hub_address("folder/a:b.htvm"));
}

TEST(WebAddress, WhatAPlaylistNamesIsWhereItIsOrAnywhere) {
    const auto base = parse_web_address("https://a.example/hls/anna/stream.m3u8?sign=b/c").value();
    const auto resolved = [&](const char* reference) {
        const auto out = resolved_reference(base, reference);
        return out ? web_text(*out) : "refused";
    };
    EXPECT_EQ(resolved("1.m4s"), "https://a.example/hls/anna/1.m4s");
    EXPECT_EQ(resolved("../../1.m4s?x=../y#z"), "https://a.example/1.m4s?x=../y");
    EXPECT_EQ(resolved("../../../../1.m4s"), "https://a.example/1.m4s");
    EXPECT_EQ(resolved("./b/."), "https://a.example/hls/anna/b/");
    EXPECT_EQ(resolved("/1.m4s"), "https://a.example/1.m4s");
    EXPECT_EQ(resolved("//b.example:8443/1.m4s"), "https://b.example:8443/1.m4s");
    EXPECT_EQ(resolved("http://b.example/1.m4s"), "http://b.example/1.m4s");
    EXPECT_EQ(resolved("?part=1"), "https://a.example/hls/anna/stream.m3u8?part=1");
    for (const char* other :
         {"file:///etc/passwd", "ftp://b.example/1", "javascript:1", "https://me:pw@b.example/", "a b"})
        EXPECT_EQ(resolved(other), "refused") << other;
    EXPECT_EQ(shown_web(base), "https://a.example/hls/anna/stream.m3u8");
    EXPECT_TRUE(looks_like_web_address("HTTPS://a"));
    EXPECT_FALSE(looks_like_web_address("ws://a"));
}

}  // namespace
}  // namespace htvm::live
