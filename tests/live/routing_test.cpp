// Which handler a request is for.
#include "live/files/routing.h"

#include <gtest/gtest.h>

#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/verb.hpp>
#include <string>
#include <vector>

namespace htvm::live {
namespace {

namespace http = boost::beast::http;

Request request(const std::string& target, http::verb method = http::verb::get) { return {method, target, 11}; }

Request upgrade(const std::string& target, http::verb method = http::verb::get) {
    auto out = request(target, method);
    out.set(http::field::connection, "Upgrade");
    out.set(http::field::upgrade, "websocket");
    return out;
}

Handler handler(const Request& request, bool has_hub = true) { return route_of(request, has_hub).handler; }

TEST(Routing, EachPathHasItsHandler) {
    EXPECT_EQ(handler(request("/")), Handler::page);
    EXPECT_EQ(handler(request("/?file=a.htvm")), Handler::page);
    EXPECT_EQ(handler(request("/player/player.js")), Handler::player_file);
    EXPECT_EQ(handler(request("/api/files")), Handler::file_list);
    EXPECT_EQ(handler(request("/api/streams")), Handler::stream_list);
    EXPECT_EQ(handler(request("/healthz")), Handler::health);
    EXPECT_EQ(handler(request("/readyz")), Handler::readiness);
    EXPECT_EQ(handler(request("/metrics")), Handler::metrics);
    EXPECT_EQ(handler(request("/metrics", http::verb::head)), Handler::metrics);
    for (const char* path : {"/files", "/player", "/api", "/api/others", "/healthz/a", "/player/a/b", "/play", "/a"})
        EXPECT_EQ(handler(request(path)), Handler::nothing) << path;
}

TEST(Routing, FilesHaveTheSegmentsOfTheirPath) {
    const auto route = route_of(request("/files/a%20b/c.htvm?expires=1"), false);
    EXPECT_EQ(route.handler, Handler::file);
    EXPECT_EQ(route.path, (std::vector<std::string>{"a b", "c.htvm"}));
}

TEST(Routing, LiveStreamsAreThereWithAHubAlone) {
    EXPECT_EQ(handler(request("/play/anna")), Handler::page);
    EXPECT_EQ(handler(request("/watch/anna")), Handler::watch);
    EXPECT_EQ(handler(upgrade("/publish/anna")), Handler::publish);
    for (const char* path : {"/play/anna", "/watch/anna", "/publish/anna"})
        EXPECT_EQ(handler(upgrade(path), false), Handler::nothing) << path;
    // The list says itself that there is none.
    EXPECT_EQ(handler(request("/api/streams"), false), Handler::stream_list);
}

TEST(Routing, PublishingIsByAWebSocketAndWatchingMayBe) {
    EXPECT_EQ(handler(request("/publish/anna")), Handler::nothing);
    const auto publish = route_of(upgrade("/publish/anna?token=1"), true);
    EXPECT_TRUE(publish.is_live());
    EXPECT_TRUE(publish.socket);
    EXPECT_EQ(publish.name, "anna");
    EXPECT_TRUE(route_of(upgrade("/watch/anna"), true).socket);
    const auto body = route_of(request("/watch/anna"), true);
    EXPECT_TRUE(body.is_live());
    EXPECT_FALSE(body.socket);
    EXPECT_FALSE(route_of(request("/watch/anna", http::verb::head), true).is_live());
}

TEST(Routing, OtherMethodsAndPathsThatLeadElsewhereHaveNone) {
    EXPECT_EQ(handler(request("/", http::verb::post)), Handler::wrong_method);
    EXPECT_EQ(handler(upgrade("/publish/anna", http::verb::post)), Handler::wrong_method);
    EXPECT_EQ(handler(request("/files/../secret")), Handler::bad_path);
    EXPECT_EQ(handler(request("/files/..", http::verb::put)), Handler::wrong_method);
}

}  // namespace
}  // namespace htvm::live
