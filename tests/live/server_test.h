// A server that runs for a test, on this machine's loopback address, with a folder of its own; and simple clients.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio.hpp>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "live/server/server.h"
#include "soon.h"

namespace htvm::live {

class ServerTest : public testing::Test {
protected:
    using tcp = boost::asio::ip::tcp;

    ServerTest() {
        auto name = (std::filesystem::temp_directory_path() / "htvm-server-XXXXXX").string();
        EXPECT_TRUE(mkdtemp(name.data()));
        root = name;
        options.folder = (root / "served").string();
        options.line_threads = line_threads();
        std::filesystem::create_directory(options.folder);
    }
    ~ServerTest() override { std::filesystem::remove_all(root); }
    // The server ends before what a test has given it.
    void TearDown() override {
        stop();
        server.reset();
    }

    void start() {
        auto opened = Server::open(options);
        ASSERT_TRUE(opened) << opened.error().message;
        server.emplace(std::move(*opened));
        thread = std::thread([this] { server->run(); });
    }
    // Unless it has been waited for: thread.join().
    void stop() {
        if (!thread.joinable()) return;
        server->stop();
        thread.join();
    }

    tcp::socket connect() {
        tcp::socket socket(context);
        socket.connect({boost::asio::ip::make_address("127.0.0.1"), server->port()});
        return socket;
    }
    // All that the server sends until it closes the connection.
    static std::string read_all(tcp::socket& socket) {
        std::string out;
        boost::system::error_code error;
        boost::asio::read(socket, boost::asio::dynamic_buffer(out), error);
        return out;
    }
    // The response to one request; headers end in \r\n each.
    std::string get(const std::string& target, const std::string& headers = "", const std::string& method = "GET") {
        auto socket = connect();
        boost::asio::write(socket, boost::asio::buffer(method + ' ' + target + " HTTP/1.1\r\nHost: " + host +
                                                       "\r\nConnection: close\r\n" + headers + "\r\n"));
        return read_all(socket);
    }
    // Whether the metrics come to hold this line: what a client sees may come before the server counts it.
    testing::AssertionResult metrics_come_to(const std::string& line) {
        return soon([&] { return get("/metrics").find('\n' + line + '\n') != std::string::npos; });
    }
    static int status(const std::string& response) {
        return response.size() > 12 ? std::atoi(response.c_str() + 9) : 0;
    }
    static std::string body(const std::string& response) { return response.substr(response.find("\r\n\r\n") + 4); }
    static std::string header(const std::string& response, const std::string& name) {
        const auto at = response.find("\r\n" + name + ": ");
        if (at == std::string::npos || at > response.find("\r\n\r\n")) return "";
        const auto begin = at + name.size() + 4;
        return response.substr(begin, response.find("\r\n", begin) - begin);
    }

    // How ./dev races asks for servers with threads for their lines.
    static unsigned line_threads() {
        const char* asked = std::getenv("HTVM_LINE_THREADS");
        return asked ? static_cast<unsigned>(std::atoi(asked)) : 0;
    }

    std::filesystem::path root;
    std::string host = "127.0.0.1";  // as clients call it
    ServerOptions options;
    std::optional<Server> server;
    std::thread thread;
    boost::asio::io_context context;
};

}  // namespace htvm::live
