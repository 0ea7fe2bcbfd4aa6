// The server of `htvm play`, on this machine's loopback address.
#include "live/files/local_server.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>

#include "live/files/player_files.h"

namespace htvm::live {
namespace {

namespace fs = std::filesystem;
namespace net = boost::asio;
using tcp = net::ip::tcp;

class LocalServerTest : public testing::Test {
protected:
    LocalServerTest() {
        fs::create_directories(root / "streams" / "inner");
        write("secret.htvm", "secret");
        write("streams/person.htvm", "0123456789");
        write("streams/inner/a b.htvm", "inner");
        write("streams/notes.txt", "notes");
        fs::create_symlink(root / "secret.htvm", root / "streams" / "link.htvm");
    }
    ~LocalServerTest() override {
        if (server) server->stop();
        if (thread.joinable()) thread.join();
        fs::remove_all(root);
    }
    void write(const std::string& name, const std::string& text) const { std::ofstream(root / name) << text; }
    void start(const LocalServerOptions& options) {
        auto opened = LocalServer::open(options);
        ASSERT_TRUE(opened) << opened.error().message;
        server.emplace(std::move(*opened));
        thread = std::thread([this] { server->run(); });
    }
    void start() { start({.folder = (root / "streams").string()}); }

    // All that comes back until the connection ends.
    std::string sent(const std::string& request) const {
        net::io_context context;
        tcp::socket socket(context);
        socket.connect({net::ip::address_v4::loopback(), server->port()});
        net::write(socket, net::buffer(request));
        std::string out;
        boost::system::error_code ended;
        net::read(socket, net::dynamic_buffer(out), ended);
        return out;
    }
    std::string get(const std::string& path, const std::string& headers = "", const std::string& host = "localhost",
                    const std::string& method = "GET") const {
        return sent(method + ' ' + path + " HTTP/1.1\r\nHost: " + host + "\r\n" + headers +
                    "Connection: close\r\n\r\n");
    }
    static int status(const std::string& answer) { return answer.size() > 12 ? std::stoi(answer.substr(9, 3)) : 0; }
    static std::string body(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }

    const fs::path root = fs::temp_directory_path() / ("htvm_local_server_" + std::to_string(::getpid()));
    std::optional<LocalServer> server;
    std::thread thread;
};

TEST_F(LocalServerTest, GivesTheStreamsOfAFolderWholeAndInParts) {
    start();
    EXPECT_EQ(body(get("/files/person.htvm")), "0123456789");
    EXPECT_EQ(body(get("/files/inner/a%20b.htvm")), "inner");
    const auto part = get("/files/person.htvm", "Range: bytes=5-7\r\n");
    EXPECT_EQ(status(part), 206);
    EXPECT_EQ(body(part), "567");
    EXPECT_EQ(body(get("/api/files")), R"([{"bytes":5,"path":"inner/a b.htvm"},{"bytes":10,"path":"person.htvm"}])");
    EXPECT_EQ(body(get("/api/streams")), "null");
}

TEST_F(LocalServerTest, GivesNothingElseOfTheDisk) {
    start();
    for (const char* other :
         {"/files/notes.txt", "/files/link.htvm", "/files/inner", "/files/none.htvm", "/etc/passwd"})
        EXPECT_EQ(status(get(other)), 404) << other;
    for (const char* upwards :
         {"/files/../secret.htvm", "/files/%2e%2e/secret.htvm", "/files/inner%2f..%2fperson.htvm"})
        EXPECT_EQ(status(get(upwards)), 400) << upwards;
}

TEST_F(LocalServerTest, GivesNamedFilesAlone) {
    start({.files = {{"beside/one.htvm", (root / "secret.htvm").string()}}});
    EXPECT_EQ(body(get("/files/beside/one.htvm")), "secret");
    EXPECT_EQ(status(get("/files/person.htvm")), 404);
    EXPECT_EQ(body(get("/api/files")), R"([{"bytes":6,"path":"beside/one.htvm"}])");
}

TEST_F(LocalServerTest, AnswersNobodyWhoCallsItByAnotherName) {
    start();
    EXPECT_EQ(status(get("/files/person.htvm", "", "127.0.0.1:" + std::to_string(server->port()))), 200);
    EXPECT_EQ(status(get("/files/person.htvm", "", "evil.example")), 421);
    EXPECT_EQ(status(get("/files/person.htvm", "", "localhost:1")), 421);
}

TEST_F(LocalServerTest, GivesThePlayerWhereItIsInside) {
    start();
    if (!has_player()) {
        EXPECT_EQ(status(get("/")), 404);
        return;
    }
    const auto page = get("/");
    EXPECT_EQ(status(page), 200);
    EXPECT_NE(page.find("Content-Security-Policy: default-src 'none'"), std::string::npos);
    EXPECT_NE(page.find("Cross-Origin-Resource-Policy: same-origin"), std::string::npos);
    for (const auto& file : player_files())
        EXPECT_EQ(body(get("/player/" + std::string(file.name))), file.content) << file.name;
}

TEST_F(LocalServerTest, KeepsAConnectionForMoreRequests) {
    start();
    const std::string request = "GET /files/person.htvm HTTP/1.1\r\nHost: localhost\r\n";
    const auto both = sent(request + "\r\n" + request + "Connection: close\r\n\r\n");
    EXPECT_NE(both.find("0123456789"), both.rfind("0123456789"));
}

TEST_F(LocalServerTest, RefusesWhatIsNoRequestOfItsKind) {
    start();
    EXPECT_EQ(status(sent("hello\r\n\r\n")), 400);
    EXPECT_EQ(status(sent("GET / HTTP/1.1\r\n\r\n")), 400);  // no host
    EXPECT_EQ(status(sent("GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc")), 400);
    EXPECT_EQ(status(sent("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(10000, 'x') + "\r\n\r\n")), 400);
    EXPECT_EQ(status(get("/files/person.htvm", "", "localhost", "PUT")), 405);
    EXPECT_EQ(body(get("/files/person.htvm", "", "localhost", "HEAD")), "");
    EXPECT_EQ(status(get("/files/person.htvm")), 200);
}

TEST_F(LocalServerTest, SaysWhatIsWrongWithItsPlace) {
    start();
    const auto taken = LocalServer::open({.port = server->port()});
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().message.find("cannot listen on 127.0.0.1 port " + std::to_string(server->port())), 0u);
    EXPECT_FALSE(LocalServer::open({.folder = (root / "none").string()}));
}

}  // namespace
}  // namespace htvm::live
