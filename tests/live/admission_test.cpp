// Who is let in, by address, host and origin. Tokens and links: credentials_test.cpp; over the network:
// server_access_test.cpp.
#include "live/server/admission.h"

#include <gtest/gtest.h>

#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/verb.hpp>
#include <optional>
#include <string>
#include <vector>

namespace htvm::live {
namespace {

namespace http = boost::beast::http;

boost::asio::ip::address address(const std::string& text) { return boost::asio::ip::make_address(text); }

Request request(const std::string& host, const std::string& origin = "") {
    Request out{http::verb::get, "/watch/anna", 11};
    out.set(http::field::host, host);
    if (!origin.empty()) out.set(http::field::origin, origin);
    return out;
}

TEST(Admission, ConnectionsOfAnAddressAreBoundedAndAllTogether) {
    Admission admission({.connections = 3, .connections_per_address = 2});
    std::vector<AddressCounts::Place> places;
    const auto admit = [&](const std::string& from) {
        auto place = admission.admit_connection(address(from));
        if (place) places.push_back(std::move(*place));
        return place.has_value();
    };
    EXPECT_TRUE(admit("192.0.2.1"));
    EXPECT_TRUE(admit("192.0.2.1"));
    EXPECT_FALSE(admit("192.0.2.1"));
    EXPECT_FALSE(admit("::ffff:192.0.2.1"));  // the same by IPv6
    EXPECT_TRUE(admit("192.0.2.2"));
    EXPECT_FALSE(admit("192.0.2.3"));
    EXPECT_EQ(admission.connections(), 3u);
    places.pop_back();
    EXPECT_EQ(admission.connections(), 2u);
    EXPECT_TRUE(admit("192.0.2.3"));
}

TEST(Admission, ANetworkOfIPv6IsOneAddress) {
    Admission admission({.viewers_per_address = 1});
    const auto watches = [&](const std::string& from) {
        return admission.admit_viewer(request("hub.example"), "anna", false, address(from));
    };
    const auto first = watches("2001:db8::1");
    EXPECT_TRUE(first);
    const auto second = watches("2001:db8::ffff:2");
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().cause, "address");
    EXPECT_EQ(second.error().code, CloseCode::try_later);
    EXPECT_TRUE(watches("2001:db8:0:1::1"));
}

TEST(Admission, OnTheLoopbackOtherHostsAreRefused) {
    Admission strict({.loopback_names = true}), open({});
    strict.listens_on(8080);
    for (const char* host : {"127.0.0.1:8080", "localhost:8080", "localhost", "[::1]:8080"})
        EXPECT_TRUE(strict.host_allowed(request(host))) << host;
    for (const char* host : {"evil.example", "evil.example:8080", "localhost:8081", ""}) {
        EXPECT_FALSE(strict.host_allowed(request(host))) << host;
        EXPECT_TRUE(open.host_allowed(request(host))) << host;
    }
}

TEST(Admission, OfHostsWithNamesOthersAreRefused) {
    Admission named({.hosts = {"Hub.example"}});
    named.listens_on(8080);
    for (const char* host : {"hub.example", "HUB.EXAMPLE:8443", "127.0.0.1:8080"})
        EXPECT_TRUE(named.host_allowed(request(host))) << host;
    for (const char* host : {"evil.example", "hub.example.evil.example", ""})
        EXPECT_FALSE(named.host_allowed(request(host))) << host;
}

TEST(Admission, SitesAreTheSameInAnyCaseAndWithTheirSchemesPort) {
    Admission one({.origins = {"https://A.example:443", "http://b.example"}});
    const auto watches = [&](const std::string& origin, const std::string& host) {
        return one.admit_viewer(request(host, origin), "anna", true, address("192.0.2.1")).has_value();
    };
    for (const char* origin : {"https://a.example", "HTTPS://a.EXAMPLE:443", "http://b.example:80"})
        EXPECT_TRUE(watches(origin, "hub.example")) << origin;
    for (const char* origin : {"http://a.example", "https://a.example:80", "https://b.example"})
        EXPECT_FALSE(watches(origin, "hub.example")) << origin;
    EXPECT_TRUE(watches("https://hub.example", "HUB.example:443"));
    EXPECT_TRUE(watches("http://hub.example:80", "hub.example"));
    EXPECT_FALSE(watches("https://hub.example", "hub.example:80"));
}

TEST(Admission, WithoutPublishersOnlyProgramsOnThisMachinePublish) {
    const Admission admission({.other_sites = true});
    const auto refusal = [&](const Request& request, const std::string& from) {
        const auto out = admission.refuse_publishing(request, "anna", address(from));
        return out ? out->cause : "";
    };
    EXPECT_EQ(refusal(request("hub.example"), "127.0.0.1"), "");
    EXPECT_EQ(refusal(request("hub.example"), "::ffff:127.0.0.1"), "");
    EXPECT_EQ(refusal(request("hub.example"), "192.0.2.1"), "token");
    EXPECT_EQ(refusal(request("hub.example", "https://evil.example"), "127.0.0.1"), "token");
    auto forwarded = request("hub.example");
    forwarded.set("X-Forwarded-For", "192.0.2.1");
    EXPECT_EQ(refusal(forwarded, "127.0.0.1"), "token");
    const auto name = admission.refuse_publishing(request("hub.example"), "../anna", address("127.0.0.1"));
    ASSERT_TRUE(name);
    EXPECT_EQ(name->cause, "name");
}

TEST(Admission, PagesOfOtherSitesWatchOnlyIfAllowed) {
    Admission none({}), one({.origins = {"https://a.example"}}), all({.other_sites = true});
    const auto watches = [](Admission& admission, const std::string& origin) {
        return admission.admit_viewer(request("hub.example", origin), "anna", true, address("192.0.2.1")).has_value();
    };
    for (auto* admission : {&none, &one, &all}) {
        EXPECT_TRUE(watches(*admission, ""));
        EXPECT_TRUE(watches(*admission, "https://hub.example"));
    }
    EXPECT_FALSE(watches(none, "https://a.example"));
    EXPECT_TRUE(watches(one, "https://a.example"));
    EXPECT_FALSE(watches(one, "https://b.example"));
    EXPECT_TRUE(watches(all, "https://b.example"));
}

}  // namespace
}  // namespace htvm::live
