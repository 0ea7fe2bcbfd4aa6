// Who is let in by the server: tokens, links, origins, TLS, and its end. On this machine's loopback address.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/x509.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/ssl.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>

#include "certificate.h"
#include "live/server/credentials.h"
#include "live_packets.h"
#include "server_test.h"
#include "web_socket.h"

namespace htvm::live {
namespace {

namespace fs = std::filesystem;
namespace net = boost::asio;
namespace beast = boost::beast;
using std::chrono::seconds;
using std::chrono::system_clock;
using testing::HasSubstr;
using testing::MatchesRegex;

class ServerAccessTest : public ServerTest {
protected:
    ServerAccessTest() {
        std::ofstream(root / "served" / "person.htvm") << "person";
        host = "hub.example";
        options.hub = &hub;
        options.header_time = seconds(1);
        options.admission.refusal_delay = {};
        options.log = [this](const Event& event) {
            const std::lock_guard lock(mutex);
            events.push_back(event);
        };
    }
    std::string file(const std::string& name) const { return (root / name).string(); }

    WebSocket open(const std::string& target, const std::string& name = "", const std::string& value = "") {
        return WebSocket::open(connect(), host, target, name, value);
    }
    // A stream of one frame.
    static void begin(WebSocket& publisher) {
        publisher.send(live_header(1));
        publisher.send(live_intra(0));
    }
    unsigned opened(const std::string& target, const std::string& name = "", const std::string& value = "") {
        return open(target, name, value).status;
    }

    std::size_t count_of(const std::string& name) {
        const std::lock_guard lock(mutex);
        return static_cast<std::size_t>(
            std::count_if(events.begin(), events.end(), [&](const Event& event) { return event.name == name; }));
    }
    // At least so many of these events: what a client sees may come before the server tells of it.
    testing::AssertionResult counts_to(const std::string& name, std::size_t count) {
        return soon([&] { return count_of(name) >= count; });
    }
    void wait_for_stream(const std::string& name) {
        const auto listed = "\"name\":\"" + name + "\",\"packets\":2";
        EXPECT_TRUE(soon([&] { return get("/api/streams").find(listed) != std::string::npos; })) << get("/api/streams");
    }
    // Sent to this process; the server must be running, since it takes the signal.
    void hang_up_and_wait_for(const std::string& name) {
        const auto before = count_of(name);
        get("/");
        std::raise(SIGHUP);
        ASSERT_TRUE(counts_to(name, before + 1));
    }

    // Nobody sends heartbeats here, and the machine may be slow.
    Hub hub{HubLimits{.publisher_silence = std::chrono::minutes(1)}};
    std::mutex mutex;
    std::vector<Event> events;
};

TEST_F(ServerAccessTest, PublishingNeedsTheTokenOfTheStreamAndRefusalsHurtNobody) {
    options.admission.publishers = file("publishers.json");
    const auto anna = add_publisher(options.admission.publishers, "anna").value();
    const auto ben = add_publisher(options.admission.publishers, "ben").value();
    start();
    auto publisher = open("/publish/anna", "Authorization", "Bearer " + anna);
    ASSERT_EQ(publisher.status, 101u);
    begin(publisher);
    wait_for_stream("anna");
    EXPECT_EQ(opened("/publish/anna"), 401u);
    EXPECT_EQ(opened("/publish/anna", "Authorization", "Bearer " + ben), 401u);
    EXPECT_EQ(opened("/publish/anna", "Authorization", "Basic " + anna), 401u);
    EXPECT_EQ(opened("/publish/anna?token=" + ben), 401u);
    EXPECT_EQ(opened("/publish/nobody", "Authorization", "Bearer " + anna), 401u);
    EXPECT_EQ(opened("/publish/ben?token=" + ben), 101u);
    EXPECT_TRUE(counts_to("refused", 5));
    EXPECT_EQ(count_of("refused"), 5u);
    auto viewer = open("/watch/anna");
    EXPECT_EQ(viewer.next_frame(), 0u);  // the sequence header
    publisher.send(live_intra(1));
    EXPECT_EQ(viewer.next_frame(), 0u);
    EXPECT_EQ(viewer.next_frame(), 1u);
}

TEST_F(ServerAccessTest, AWrongTokenIsAnsweredLate) {
    options.admission.publishers = file("publishers.json");
    ASSERT_TRUE(add_publisher(options.admission.publishers, "anna"));
    options.admission.refusal_delay = seconds(1);
    start();
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(opened("/publish/anna?token=guess"), 401u);
    EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(990));
}

TEST_F(ServerAccessTest, APublisherWhoIsAddedIsKnownAfterAHangup) {
    options.admission.publishers = file("publishers.json");
    ASSERT_TRUE(add_publisher(options.admission.publishers, "anna"));
    start();
    const auto ben = add_publisher(options.admission.publishers, "ben").value();
    EXPECT_EQ(opened("/publish/ben?token=" + ben), 401u);
    hang_up_and_wait_for("reloaded");
    EXPECT_EQ(opened("/publish/ben?token=" + ben), 101u);
    std::ofstream(options.admission.publishers) << "{";
    hang_up_and_wait_for("reload_failed");
    EXPECT_EQ(opened("/publish/ben?token=" + ben), 101u);
}

TEST_F(ServerAccessTest, AFolderInPlaceOfAFileChangesNothingAtAHangup) {
    for (auto* place :
         {&options.admission.publishers, &options.admission.link_keys, &options.admission.web_token_keys}) {
        options.admission = {};
        options.admission.refusal_delay = {};
        *place = file("who");
        fs::create_directory(*place);
        EXPECT_THAT(Server::open(options).error().message, HasSubstr(*place + ": it is a folder"));
        fs::remove(*place);
    }
    options.admission = {};
    options.admission.refusal_delay = {};
    options.admission.publishers = file("publishers.json");
    const auto anna = add_publisher(options.admission.publishers, "anna").value();
    start();
    const auto away = file("away.json");
    fs::rename(options.admission.publishers, away);
    fs::create_directory(options.admission.publishers);
    hang_up_and_wait_for("reload_failed");
    EXPECT_EQ(opened("/publish/anna?token=" + anna), 101u);
    fs::remove(options.admission.publishers);
    fs::rename(away, options.admission.publishers);
    hang_up_and_wait_for("reloaded");
    EXPECT_EQ(opened("/publish/anna?token=" + anna), 101u);
}

TEST_F(ServerAccessTest, NamesThatAreNoNamesOfStreamsAreNotPublished) {
    start();
    for (const char* name : {"a%20b", "a%7cb", "a*", "%c3%bc", "x%3e"})
        EXPECT_EQ(opened("/publish/" + std::string(name)), 400u);
    EXPECT_EQ(opened("/publish/" + std::string(65, 'a')), 400u);
    for (const char* path :
         {"/publish/%2e%2e", "/publish/..", "/publish/a%2fb", "/publish/a%5cb", "/publish/%00", "/publish/"})
        EXPECT_NE(opened(path), 101u) << path;
    EXPECT_EQ(body(get("/api/streams")), "[]");
}

TEST_F(ServerAccessTest, WhatIsShownByLinkAloneNeedsOne) {
    options.admission.link_keys = file("keys.json");
    ASSERT_TRUE(add_link_key(options.admission.link_keys));
    start();
    auto publisher = open("/publish/anna");
    begin(publisher);
    const auto keys = read_link_keys(options.admission.link_keys).value();
    const auto link = [&](const std::string& path, int seconds_left) {
        return '/' + path + '?' + link_query(keys, path, system_clock::now() + seconds(seconds_left));
    };
    // The stream begins when its first packet comes.
    std::optional<WebSocket> viewer;
    for (int i = 0; i < 1000; ++i) {
        viewer.emplace(open(link("watch/anna", 60)));
        if (viewer->next()) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const auto expired = link("watch/anna", -1), forged = link("watch/ben", 60).replace(7, 3, "anna");
    EXPECT_EQ(status(get("/watch/anna")), 403);
    EXPECT_EQ(body(get("/watch/anna")), "this needs a link: ask whoever runs this hub (htvm link writes one)\n");
    EXPECT_EQ(status(get(expired)), 403);
    EXPECT_EQ(body(get(expired)), "this link has expired: ask for a new one\n");
    EXPECT_EQ(status(get(forged)), 403);
    for (const auto& target : {std::string("/watch/anna"), expired, forged}) {
        auto refused = open(target);
        EXPECT_EQ(refused.status, 101u);  // else a page could not read why
        EXPECT_THAT(refused.closing(), MatchesRegex("1008 .+"));
    }
    EXPECT_EQ(body(get(link("files/person.htvm", 60))), "person");
    EXPECT_EQ(status(get("/files/person.htvm")), 403);
    EXPECT_EQ(status(get(link("watch/person.htvm", 60).replace(1, 5, "files"))), 403);
    EXPECT_EQ(status(get("/api/files")), 403);
    EXPECT_EQ(status(get("/api/streams")), 403);
    EXPECT_TRUE(counts_to("refused", 7));
    publisher.send(live_intra(1));
    std::uint32_t frame = 0;
    while (frame == 0) frame = viewer->next_frame();
    EXPECT_EQ(frame, 1u);  // goes on
}

TEST_F(ServerAccessTest, OnlyPagesOfTheGivenSitesWatchAndRead) {
    options.admission.origins = {"https://a.example", "https://b.example:8443"};
    start();
    auto publisher = open("/publish/anna");
    begin(publisher);
    wait_for_stream("anna");
    const auto allowed = [&](const std::string& origin) {
        const auto response = get("/files/person.htvm", "Origin: " + origin + "\r\n");
        EXPECT_THAT(response, HasSubstr("\r\nVary: Origin\r\n"));
        const bool read = response.find("Access-Control-Allow-Origin: " + origin + "\r\n") != std::string::npos;
        EXPECT_EQ(open("/watch/anna", "Origin", origin).next().has_value(), read) << origin;
        return read;
    };
    EXPECT_TRUE(allowed("https://a.example"));
    EXPECT_TRUE(allowed("https://b.example:8443"));
    EXPECT_FALSE(allowed("https://b.example"));
    EXPECT_FALSE(allowed("http://a.example"));
    EXPECT_FALSE(allowed("https://a.example.evil.example"));
    EXPECT_FALSE(allowed("null"));
    EXPECT_EQ(open("/watch/anna", "Origin", "https://evil.example").closing_code(), 1008u);
    EXPECT_TRUE(open("/watch/anna", "Origin", "http://hub.example").next());  // the hub's own page
    EXPECT_TRUE(open("/watch/anna").next());                                  // no page at all
    EXPECT_EQ(opened("/publish/ben", "Origin", "https://evil.example"), 403u);
}

TEST_F(ServerAccessTest, AnAddressHasAFewViewers) {
    options.admission.viewers_per_address = 2;
    start();
    auto publisher = open("/publish/anna");
    begin(publisher);
    wait_for_stream("anna");
    auto first = open("/watch/anna"), second = open("/watch/anna");
    EXPECT_TRUE(first.next() && second.next());
    EXPECT_EQ(open("/watch/anna").closing_code(), 1013u);
    EXPECT_EQ(status(get("/watch/anna")), 503);
    first.stream.next_layer().close();
    EXPECT_TRUE(soon([&] { return open("/watch/anna").next().has_value(); }));
    EXPECT_TRUE(open("/watch/anna").next());
}

TEST_F(ServerAccessTest, ItEndsWhenItIsToldToAndSaysSo) {
    options.header_time = seconds(60);
    start();
    auto publisher = open("/publish/anna");
    begin(publisher);
    wait_for_stream("anna");
    auto viewer = open("/watch/anna");
    EXPECT_TRUE(viewer.next());
    auto idle = connect();
    const auto begin = std::chrono::steady_clock::now();
    std::raise(SIGTERM);
    EXPECT_EQ(viewer.closing_code(), 1001u);
    EXPECT_EQ(publisher.closing_code(), 1001u);
    EXPECT_EQ(read_all(idle), "");
    thread.join();
    EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(3));
}

TEST_F(ServerAccessTest, WhileItEndsItIsWellButNotReadyAndCarriesNoStream) {
    options.drain_time = seconds(60);
    start();
    // Somebody is being sent a file that he does not take, so that the server cannot end at once.
    std::ofstream(root / "served" / "large.htvm") << std::string(64 << 20, 'x');
    auto slow = connect();
    net::write(slow, net::buffer(std::string("GET /files/large.htvm HTTP/1.1\r\nHost: x\r\n\r\n")));
    EXPECT_EQ(status(get("/readyz")), 200);
    std::raise(SIGTERM);
    EXPECT_TRUE(soon([&] { return status(get("/readyz")) == 503; }));
    EXPECT_EQ(status(get("/healthz")), 200);
    auto late = open("/publish/anna");
    EXPECT_EQ(late.closing_code(), 1001u);
    std::raise(SIGTERM);
    thread.join();
}

TEST_F(ServerAccessTest, AServerThatSharesItsPortIsTakenOverFrom) {
    options.share_port = true;
    start();
    Hub next_hub;
    auto next_options = options;
    next_options.hub = &next_hub;
    next_options.port = server->port();
    auto next = Server::open(next_options);
    ASSERT_TRUE(next) << next.error().message;
    std::raise(SIGTERM);
    thread.join();
    std::thread running([&] { next->run(); });
    EXPECT_EQ(status(get("/readyz")), 200);
    next->stop();
    running.join();
}

TEST_F(ServerAccessTest, ASocketThatWasHandedOverIsListenedTo) {
    tcp::acceptor given(context, {net::ip::make_address("127.0.0.1"), 0});
    options.listening_socket = ::dup(given.native_handle());
    start();
    EXPECT_EQ(server->port(), given.local_endpoint().port());
    EXPECT_EQ(status(get("/readyz")), 200);
    options.listening_socket = ::open("/dev/null", O_RDONLY);
    EXPECT_FALSE(Server::open(options));
    ::close(options.listening_socket);
}

TEST_F(ServerAccessTest, ViewersAreCountedByTheAddressThatAKnownProxyNames) {
    options.trusted_proxies = {"127.0.0.1"};
    options.admission.viewers_per_address = 1;
    start();
    auto publisher = open("/publish/anna");
    ASSERT_EQ(publisher.status, 101u);
    begin(publisher);
    wait_for_stream("anna");
    auto one = open("/watch/anna", "X-Forwarded-For", "198.51.100.7, 192.0.2.1");
    EXPECT_TRUE(one.next());
    auto another = open("/watch/anna", "X-Forwarded-For", "192.0.2.2");
    EXPECT_TRUE(another.next());
    auto again = open("/watch/anna", "X-Forwarded-For", "192.0.2.2, 192.0.2.1");
    EXPECT_EQ(again.closing_code(), 1013u);
}

TEST_F(ServerAccessTest, TlsIsAgreedOnAndItsCertificateReadAgain) {
    options.certificate = file("a.pem");
    options.private_key = file("a.key");
    write_certificate(options.certificate, options.private_key, "first.example");
    start();
    const auto presented = [&](int version) {
        net::ssl::context client(net::ssl::context::tls_client);
        SSL_CTX_set_max_proto_version(client.native_handle(), version);
        SSL_CTX_set_security_level(client.native_handle(), 0);
        net::ssl::stream<tcp::socket> stream(connect(), client);
        beast::error_code error;
        stream.handshake(net::ssl::stream_base::client, error);
        if (error) return std::string();
        net::write(stream,
                   net::buffer(std::string("GET /files/person.htvm HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")));
        std::string response;
        net::read(stream, net::dynamic_buffer(response), error);
        EXPECT_EQ(body(response), "person");
        EXPECT_EQ(error, net::error::eof);  // not cut off: the server took leave
        X509* certificate = SSL_get1_peer_certificate(stream.native_handle());
        std::array<char, 64> name{};
        X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name.data(), name.size());
        X509_free(certificate);
        return std::string(name.data());
    };
    EXPECT_EQ(presented(TLS1_3_VERSION), "first.example");
    EXPECT_EQ(presented(TLS1_2_VERSION), "first.example");
    EXPECT_EQ(presented(TLS1_1_VERSION), "");
    EXPECT_THAT(get("/files/person.htvm"), testing::Not(HasSubstr("person")));  // without TLS
    const auto refused = count_of("refused");
    auto silent = connect();
    EXPECT_EQ(read_all(silent), "");  // until header_time is over
    EXPECT_TRUE(counts_to("refused", refused + 1));
    EXPECT_EQ(count_of("refused"), refused + 1);
    write_certificate(options.certificate, options.private_key, "second.example");
    EXPECT_EQ(presented(TLS1_3_VERSION), "first.example");
    get("/");
    hang_up_and_wait_for("reloaded");
    EXPECT_EQ(presented(TLS1_3_VERSION), "second.example");
    std::ofstream(options.certificate) << "no certificate";
    hang_up_and_wait_for("reload_failed");
    EXPECT_EQ(presented(TLS1_3_VERSION), "second.example");
}

TEST_F(ServerAccessTest, ACertificateAndAKeyThatDoNotBelongTogetherAreRefused) {
    write_certificate(file("a.pem"), file("a.key"), "a.example");
    write_certificate(file("b.pem"), file("b.key"), "b.example");
    options.certificate = file("a.pem");
    options.private_key = file("b.key");
    EXPECT_THAT(Server::open(options).error().message, HasSubstr("b.key"));
    write_certificate(file("c.pem"), file("c.key"), "c.example", "", KeyKind::rsa);
    options.certificate = file("c.pem");
    EXPECT_THAT(Server::open(options).error().message, HasSubstr("b.key")) << "another kind of key";
    options.certificate = file("none.pem");
    EXPECT_THAT(Server::open(options).error().message, HasSubstr("none.pem"));
}

}  // namespace
}  // namespace htvm::live
