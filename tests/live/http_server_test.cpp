// The server as clients see it, who are not always polite, on this machine's loopback address.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "live/files/player_files.h"
#include "live/server/server.h"
#include "server_test.h"

namespace htvm::live {
namespace {

namespace fs = std::filesystem;
namespace net = boost::asio;
using tcp = net::ip::tcp;

class HttpServerTest : public ServerTest {
protected:
    HttpServerTest() {
        fs::create_directory(root / "served" / "inner");
        write("secret.htvm", "secret");
        write("served/person.htvm", content);
        write("served/inner/a b.htvm", "inner");
        write("served/.hidden.htvm", "hidden");
        write("served/notes.txt", "notes");
        fs::create_symlink(root / "secret.htvm", root / "served" / "link.htvm");
        fs::create_directory_symlink(root, root / "served" / "up");
    }
    void write(const std::string& name, const std::string& text) const { std::ofstream(root / name) << text; }

    const std::string content = "0123456789abcdefghij";
};

// reno is part of every kernel.
TEST_F(HttpServerTest, UsesTheCongestionControlItIsTold) {
    options.congestion_control = "reno";
    start();
    EXPECT_EQ("reno", server->congestion_control());
}

TEST_F(HttpServerTest, LeavesTheKernelsCongestionControlWhereThereIsNoneOfTheNameItIsTold) {
    start();
    options.congestion_control = "no such";
    auto other = Server::open(options);
    ASSERT_TRUE(other);
    EXPECT_EQ(server->congestion_control(), other->congestion_control());
    EXPECT_NE("", other->congestion_control());
}

TEST_F(HttpServerTest, GivesFilesWholeAndInParts) {
    start();
    const auto whole = get("/files/person.htvm");
    EXPECT_EQ(status(whole), 200);
    EXPECT_EQ(body(whole), content);
    EXPECT_EQ(header(whole, "Accept-Ranges"), "bytes");
    const auto part = get("/files/person.htvm", "Range: bytes=5-9\r\n");
    EXPECT_EQ(status(part), 206);
    EXPECT_EQ(body(part), "56789");
    EXPECT_EQ(header(part, "Content-Range"), "bytes 5-9/20");
    EXPECT_EQ(header(part, "Content-Length"), "5");
    const auto beyond = get("/files/person.htvm", "Range: bytes=20-\r\n");
    EXPECT_EQ(status(beyond), 416);
    EXPECT_EQ(header(beyond, "Content-Range"), "bytes */20");
    EXPECT_EQ(body(get("/files/inner/a%20b.htvm")), "inner");
    const auto head = get("/files/person.htvm", "", "HEAD");
    EXPECT_EQ(header(head, "Content-Length"), "20");
    EXPECT_EQ(body(head), "");
}

TEST_F(HttpServerTest, TagsTellWhetherAFileIsStillTheSame) {
    start();
    const auto tag = header(get("/files/person.htvm"), "ETag");
    ASSERT_FALSE(tag.empty());
    EXPECT_EQ(status(get("/files/person.htvm", "If-None-Match: " + tag + "\r\n")), 304);
    EXPECT_EQ(status(get("/files/person.htvm", "Range: bytes=0-4\r\nIf-Range: " + tag + "\r\n")), 206);
    write("served/person.htvm", "another, longer content");
    EXPECT_EQ(status(get("/files/person.htvm", "If-None-Match: " + tag + "\r\n")), 200);
    EXPECT_EQ(status(get("/files/person.htvm", "Range: bytes=0-4\r\nIf-Range: " + tag + "\r\n")), 200);
}

TEST_F(HttpServerTest, NothingOutsideTheFolderIsReached) {
    ASSERT_EQ(mkfifo((root / "served" / "pipe.htvm").c_str(), 0600), 0);
    start();
    for (const char* target : {"/files/../secret.htvm", "/files/%2e%2e/secret.htvm", "/files/up/secret.htvm",
                               "/files/link.htvm", "/files/.hidden.htvm", "/files/notes.txt", "/files/inner", "/files/",
                               "/files//etc/passwd", "/files/pipe.htvm", "/files/..%2fsecret.htvm",
                               "/player/../../secret.htvm", "/secret.htvm", "/files/nowhere.htvm"}) {
        const auto answer = get(target);
        EXPECT_TRUE(status(answer) == 404 || status(answer) == 400) << target << ": " << answer;
        EXPECT_EQ(answer.find("secret"), std::string::npos) << target;
    }
}

TEST_F(HttpServerTest, APathThatIsNoneIsAnsweredWithItsRule) {
    start();
    const auto answer = get("/publish/.anna");
    EXPECT_EQ(status(answer), 400);
    EXPECT_NE(answer.find("begins with '.'"), std::string::npos) << answer;
}

TEST_F(HttpServerTest, ARequestNamesOneHost) {
    start();
    const auto answer = [&](const std::string& headers) {
        auto socket = connect();
        net::write(socket, net::buffer("GET /files/person.htvm HTTP/1." + headers + "Connection: close\r\n\r\n"));
        return status(read_all(socket));
    };
    EXPECT_EQ(answer("1\r\nHost: a.example\r\n"), 200);
    EXPECT_EQ(answer("1\r\nHost: a.example\r\nHost: b.example\r\n"), 400);
    EXPECT_EQ(answer("1\r\n"), 400);
    EXPECT_EQ(answer("0\r\n"), 200);
}

TEST_F(HttpServerTest, ListsTheStreams) {
    start();
    EXPECT_EQ(body(get("/api/files")), R"([{"bytes":5,"path":"inner/a b.htvm"},{"bytes":20,"path":"person.htvm"}])");
    write("served/inner/a b.jpg", "x");
    write("served/person.jpg", "x");
    write("served/person.png", "x");
    write("served/other.png", "x");
    EXPECT_EQ(body(get("/api/files")), R"([{"bytes":5,"path":"inner/a b.htvm","poster":"inner/a b.jpg"},)"
                                       R"({"bytes":20,"path":"person.htvm","poster":"person.png"}])");
}

TEST_F(HttpServerTest, FilesWithNamesAreServedAlone) {
    options.files = {{"one.htvm", (root / "served" / "person.htvm").string()},
                     {"beside/one.htvm", (root / "secret.htvm").string()}};
    start();
    EXPECT_EQ(status(get("/files/one.htvm")), 200);
    EXPECT_EQ(body(get("/files/beside/one.htvm")), "secret");
    for (const char* other : {"/files/person.htvm", "/files/inner/a%20b.htvm", "/files/beside/person.htvm"})
        EXPECT_EQ(status(get(other)), 404) << other;
    EXPECT_EQ(body(get("/api/files")), R"([{"bytes":20,"path":"one.htvm"},{"bytes":6,"path":"beside/one.htvm"}])");
}

TEST_F(HttpServerTest, OtherSitesMayReadOnlyIfAllowed) {
    start();
    EXPECT_EQ(header(get("/files/person.htvm"), "Access-Control-Allow-Origin"), "");
    stop();
    options.admission.other_sites = true;
    start();
    EXPECT_EQ(header(get("/files/person.htvm"), "Access-Control-Allow-Origin"), "*");
    EXPECT_EQ(header(get("/files/nowhere.htvm"), "Access-Control-Allow-Origin"), "*");  // so that they learn why
    EXPECT_EQ(header(get("/api/files"), "Access-Control-Allow-Origin"), "");
}

TEST_F(HttpServerTest, HostsOfOtherNamesAreRefusedOnTheLoopback) {
    options.admission.loopback_names = true;
    start();
    EXPECT_EQ(status(get("/files/person.htvm")), 200);
    auto socket = connect();
    net::write(
        socket,
        net::buffer(std::string("GET /files/person.htvm HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")));
    EXPECT_EQ(status(read_all(socket)), 421);
}

TEST_F(HttpServerTest, ConnectionsAreKeptForMoreRequests) {
    start();
    auto socket = connect();
    const std::string request = "GET /files/person.htvm HTTP/1.1\r\nHost: x\r\n";
    net::write(socket, net::buffer(request + "\r\n" + request + "Connection: close\r\n\r\n"));
    const auto both = read_all(socket);
    EXPECT_NE(both.find(content), both.rfind(content));
}

TEST_F(HttpServerTest, WhatIsNoRequestIsRefused) {
    start();
    EXPECT_EQ(status(get("/files/person.htvm", "", "POST")), 405);
    EXPECT_EQ(status(get("/files/person.htvm", "Content-Length: 5\r\n")), 400);
    for (const auto& noise : {std::string("\x16\x03\x01\x00\xff", 5), std::string("GET\r\n\r\n"),
                              "GET / HTTP/1.1\r\nX: " + std::string(20000, 'x')}) {
        auto socket = connect();
        boost::system::error_code error;
        net::write(socket, net::buffer(noise), error);
        socket.shutdown(tcp::socket::shutdown_send, error);
        EXPECT_EQ(status(read_all(socket)), noise.size() > 10000 ? 431 : 400);
    }
    EXPECT_TRUE(metrics_come_to("htvm_refused_total{cause=\"request\"} 4"));
    EXPECT_TRUE(metrics_come_to("htvm_closed_total{cause=\"http_bad_request\"} 4"));
    EXPECT_EQ(status(get("/files/person.htvm")), 200);
}

TEST_F(HttpServerTest, ClientsThatDoNotFinishTheirRequestAreCutOff) {
    options.header_time = std::chrono::seconds(1);
    start();
    auto socket = connect();
    net::write(socket, net::buffer(std::string("GET /files/person.htvm HTTP/1.1\r\nHost")));
    EXPECT_EQ(status(read_all(socket)), 408);  // returns because the server closes the connection
    EXPECT_EQ(status(get("/files/person.htvm")), 200);
    EXPECT_TRUE(metrics_come_to("htvm_closed_total{cause=\"http_header_time\"} 1"));
}

TEST_F(HttpServerTest, ARequestThatComesAByteAtATimeIsCutOffAfterItsTimeCountedAndHoldsUpNobody) {
    options.header_time = std::chrono::seconds(1);
    start();
    auto silent = connect(), slow = connect();
    const auto begin = std::chrono::steady_clock::now();
    const auto passed = [&] { return std::chrono::steady_clock::now() - begin; };
    net::write(slow, net::buffer(std::string("GET /files/person.htvm HTTP/1.1\r\nX: ")));
    boost::system::error_code error;
    while (!error && passed() < std::chrono::seconds(10)) {
        net::write(slow, net::buffer("x", 1), error);
        EXPECT_EQ(status(get("/files/person.htvm")), 200);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the header must not get too long before
    }
    EXPECT_TRUE(error);
    EXPECT_GE(passed(), std::chrono::milliseconds(990));
    EXPECT_EQ(read_all(silent), "");  // it has asked for nothing, so nothing was refused
    EXPECT_TRUE(metrics_come_to("htvm_refused_total{cause=\"header_time\"} 1"));
}

TEST_F(HttpServerTest, ClientsThatTakeNothingAreCutOffAndHoldUpNobody) {
    write("served/large.htvm", std::string(64 << 20, 'x'));
    options.stall_time = std::chrono::seconds(1);
    options.admission.connections_per_address = 2;
    start();
    auto socket = connect();
    net::write(socket, net::buffer(std::string("GET /files/large.htvm HTTP/1.1\r\nHost: x\r\n\r\n")));
    EXPECT_EQ(status(get("/files/person.htvm")), 200);  // meanwhile
    // With a second such client no more connections are allowed, until the server gives both up.
    auto other = connect();
    net::write(other, net::buffer(std::string("GET /files/large.htvm HTTP/1.1\r\nHost: x\r\n\r\n")));
    while (status(get("/files/person.htvm")) != 200) std::this_thread::yield();
    EXPECT_LT(read_all(socket).size(), std::size_t{64} << 20);
}

TEST_F(HttpServerTest, ConnectionsAreFew) {
    options.admission.connections_per_address = 3;
    start();
    std::vector<tcp::socket> held;
    for (int i = 0; i < 3; ++i) {
        held.push_back(connect());
        net::write(held.back(), net::buffer(std::string("GET /files/person.htvm HTTP/1.1\r\nHost: x\r\n\r\n")));
        std::string answer(12, ' ');
        net::read(held.back(), net::buffer(answer));
        EXPECT_EQ(answer, "HTTP/1.1 200");
    }
    EXPECT_EQ(status(get("/files/person.htvm")), 503);
    held.clear();
    while (status(get("/files/person.htvm")) != 200) std::this_thread::yield();  // once the server has noticed
}

TEST_F(HttpServerTest, ThePageForbidsWhatItDoesNotNeed) {
    if (!has_player()) GTEST_SKIP() << "built without the player";
    start();
    const auto page = get("/", "Accept-Encoding: identity\r\n");
    EXPECT_NE(page.find("<!doctype html>"), std::string::npos);
    EXPECT_NE(header(page, "Content-Security-Policy").find("script-src 'self' 'wasm-unsafe-eval'"), std::string::npos);
    const auto script = get("/player/htvm-player.js", "Accept-Encoding: gzip\r\n");
    EXPECT_EQ(header(script, "Content-Encoding"), "gzip");
    EXPECT_EQ(body(script).substr(0, 2), "\x1f\x8b");
    EXPECT_EQ(header(get("/player/htvm_decoder.wasm"), "Content-Type"), "application/wasm");
    EXPECT_EQ(status(get("/", "If-None-Match: " + header(page, "ETag") + "\r\n")), 304);
}

TEST_F(HttpServerTest, TellsProgramsOnThisMachineWhatItCounts) {
    start();
    EXPECT_EQ(body(get("/healthz")), "ok\n");
    EXPECT_EQ(body(get("/readyz")), "ready\n");
    const auto metrics = get("/metrics");
    EXPECT_EQ(header(metrics, "Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
    EXPECT_NE(body(metrics).find("\nhtvm_connections 1\n"), std::string::npos) << metrics;
    EXPECT_NE(body(metrics).find("\nhtvm_refused_total{cause=\"connections\"} 0\n"), std::string::npos) << metrics;
    // Who comes through a web server on this machine may be anybody.
    EXPECT_EQ(status(get("/metrics", "X-Forwarded-For: 192.0.2.1\r\n")), 403);
    EXPECT_EQ(status(get("/metrics", "Origin: https://a.example\r\n")), 403);
}

TEST_F(HttpServerTest, TellsEverybodyWhatItCountsIfAllowed) {
    options.admission.metrics_anyone = true;
    start();
    EXPECT_EQ(status(get("/metrics", "X-Forwarded-For: 192.0.2.1\r\n")), 200);
}

TEST_F(HttpServerTest, TellsHowLongAnswersTakeAndWhyConnectionsEnd) {
    start();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status(get("/files/person.htvm")), 200);
    EXPECT_TRUE(metrics_come_to("htvm_answer_seconds_count{handler=\"file\"} 3"));
    EXPECT_TRUE(metrics_come_to("htvm_answer_seconds_bucket{handler=\"file\",le=\"+Inf\"} 3"));
    // They asked for the connection to be closed.
    EXPECT_NE(get("/metrics").find("\nhtvm_closed_total{cause=\"http_done\"} "), std::string::npos);
}

TEST_F(HttpServerTest, TellsOfEveryRequestWithoutWhatMayBeSecret) {
    std::mutex mutex;
    std::vector<Event> told;
    options.access_log = [&](const Event& event) {
        const std::lock_guard lock(mutex);
        told.push_back(event);
    };
    start();
    EXPECT_EQ(status(get("/files/person.htvm?signature=secret")), 200);
    EXPECT_TRUE(soon([&] {
        const std::lock_guard lock(mutex);
        return told.size() == 1;
    }));
    const std::lock_guard lock(mutex);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].address, "127.0.0.1");
    EXPECT_EQ(told[0].words,
              (std::vector<std::pair<std::string, std::string>>{{"method", "GET"}, {"path", "/files/person.htvm"}}));
    EXPECT_EQ(told[0].numbers[0], (std::pair<std::string, std::int64_t>{"status", 200}));
    EXPECT_EQ(told[0].numbers[1],
              (std::pair<std::string, std::int64_t>{"bytes", static_cast<std::int64_t>(content.size())}));
    EXPECT_EQ(told[0].text.find("secret"), std::string::npos);
}

TEST_F(HttpServerTest, WhomAKnownProxyNamesIsCountedByThatAddress) {
    options.trusted_proxies = {"127.0.0.0/8"};
    options.proxy_protocol = true;
    options.admission.connections_per_address = 1;
    start();
    const auto through = [&](const std::string& header) {
        auto socket = connect();
        net::write(socket, net::buffer(header + "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n"));
        return socket;
    };
    const auto first_line = [](tcp::socket& socket) {
        std::string answer(12, ' ');
        boost::system::error_code error;
        net::read(socket, net::buffer(answer), error);
        return error ? "" : answer;
    };
    auto anna = through("PROXY TCP4 192.0.2.1 192.0.2.9 4711 80\r\n");
    EXPECT_EQ(first_line(anna), "HTTP/1.1 403") << "she is no program on this machine";
    auto again = through("PROXY TCP4 192.0.2.1 192.0.2.9 4712 80\r\n");
    EXPECT_EQ(first_line(again), "") << "she has one connection already";
    auto ben = through("PROXY TCP4 192.0.2.2 192.0.2.9 4713 80\r\n");
    EXPECT_EQ(first_line(ben), "HTTP/1.1 403");
    auto check = through(std::string("\r\n\r\n\0\r\nQUIT\n\x20\0\0\0", 16));
    EXPECT_EQ(first_line(check), "HTTP/1.1 200") << "the proxy itself asks";
    auto none = through("");
    EXPECT_EQ(first_line(none), "") << "a proxy must say for whom it is";
}

TEST_F(HttpServerTest, AFolderThatIsNotThereIsAnError) {
    options.folder = (root / "nowhere").string();
    EXPECT_FALSE(Server::open(options));
    options.folder = root.string();
    options.address = "not an address";
    EXPECT_FALSE(Server::open(options));
}

}  // namespace
}  // namespace htvm::live
