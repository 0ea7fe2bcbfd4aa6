// Who may, by the word of a web service, of tokens that others signed, and of links that were taken back: a server that
// asks, and what it asks.
#include "live/server/authority.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/ssl.hpp>
#include <boost/beast/http.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "certificate.h"
#include "live/server/credentials.h"
#include "live_packets.h"
#include "server_test.h"
#include "web_socket.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using std::chrono::system_clock;
using tcp = net::ip::tcp;

TEST(Authority, AnswersHoldAsLongAsTheySay) {
    EXPECT_EQ(max_age("max-age=60").count(), 60);
    EXPECT_EQ(max_age("private, Max-Age=60").count(), 60);
    EXPECT_EQ(max_age("max-age=999999").count(), 3600);
    for (const char* none :
         {"", "max-age", "max-age=", "max-age=-1", "max-age=6x", "s-maxage=60", "max-age=60, no-store"})
        EXPECT_EQ(max_age(none).count(), 0) << none;
}

TEST(Authority, ItsAddressIsOneOfHttp) {
    for (const char* good : {"http://127.0.0.1:9/may", "https://auth.example", "HTTPS://auth.example/a?b=c"})
        EXPECT_TRUE(Authority::open({.url = good})) << good;
    for (const char* wrong : {"ftp://a.example", "auth.example", "http://", "http://a:b@c/", "ws://a.example", "https"})
        EXPECT_FALSE(Authority::open({.url = wrong})) << wrong;
}

// A service that answers each question by what a test gives: a status and headers; 0: never. By TLS if it has a
// certificate, beside which is its key, NAME.key.
class Service {
public:
    explicit Service(std::function<std::pair<unsigned, std::string>(const nlohmann::json&)> answer,
                     const std::string& certificate = "")
        : answer_(std::move(answer)), acceptor_(context_, {net::ip::make_address("127.0.0.1"), 0}) {
        if (!certificate.empty()) {
            tls_.emplace(net::ssl::context::tls_server);
            tls_->use_certificate_file(certificate, net::ssl::context::pem);
            tls_->use_private_key_file(certificate + ".key", net::ssl::context::pem);
        }
        thread_ = std::thread([this] { run(); });
    }
    ~Service() {
        // A connection without a question ends it.
        ending_ = true;
        tcp::socket last(context_);
        beast::error_code ignored;
        last.connect(acceptor_.local_endpoint(), ignored);
        last.close();
        thread_.join();
    }
    std::string url() const {
        return (tls_ ? "https" : "http") +
               ("://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + "/may");
    }
    std::vector<nlohmann::json> asked() const {
        const std::lock_guard lock(mutex_);
        return asked_;
    }

private:
    void run() {
        std::vector<tcp::socket> silent;
        while (!ending_) {
            tcp::socket socket(context_);
            beast::error_code error;
            acceptor_.accept(socket, error);
            if (tls_) {
                net::ssl::stream<tcp::socket&> secure(socket, *tls_);
                secure.handshake(net::ssl::stream_base::server, error);
                if (!error) answer(secure);
            } else if (!answer(socket)) {
                silent.push_back(std::move(socket));
            }
        }
    }
    // Whether there was an answer, or no question.
    template <typename Stream>
    bool answer(Stream& stream) {
        beast::error_code error;
        beast::flat_buffer buffer;
        http::request<http::string_body> request;
        http::read(stream, buffer, request, error);
        if (error) return true;
        const auto question = nlohmann::json::parse(request.body(), nullptr, false);
        const auto [status, headers] = answer_(question);
        {
            const std::lock_guard lock(mutex_);
            asked_.push_back(question);
        }
        if (status == 0) return false;
        net::write(stream,
                   net::buffer("HTTP/1.1 " + std::to_string(status) + " X\r\n" + headers + "Content-Length: 0\r\n\r\n"),
                   error);
        return true;
    }
    std::function<std::pair<unsigned, std::string>(const nlohmann::json&)> answer_;
    std::atomic<bool> ending_ = false;
    mutable std::mutex mutex_;
    std::vector<nlohmann::json> asked_;
    net::io_context context_;
    std::optional<net::ssl::context> tls_;
    tcp::acceptor acceptor_;
    std::thread thread_;
};

class AskedServerTest : public ServerTest {
protected:
    AskedServerTest() {
        options.hub = &hub;
        options.admission.refusal_delay = {};
    }
    WebSocket open(const std::string& target, const std::string& name = "", const std::string& value = "") {
        return WebSocket::open(connect(), host, target, name, value);
    }
    // Publishes anna's stream, which goes on until the test ends.
    void publish(const std::string& token = "") {
        publisher.emplace(token.empty() ? open("/publish/anna")
                                        : open("/publish/anna", "Authorization", "Bearer " + token));
        ASSERT_EQ(publisher->status, 101u);
        publisher->send(live_header(1));
        publisher->send(live_intra(0));
        ASSERT_TRUE(soon([&] { return get("/metrics").find("\nhtvm_packets_in_total 2\n") != std::string::npos; }));
    }
    Hub hub;
    std::optional<WebSocket> publisher;
};

TEST_F(AskedServerTest, WhomTheServiceNamesMayPublishAndWatch) {
    Service service([](const nlohmann::json& question) {
        return std::pair(question["token"] == "right" ? 200u : 403u, std::string());
    });
    options.authority.url = service.url();
    start();
    EXPECT_EQ(open("/publish/anna").status, 401u);
    EXPECT_EQ(open("/publish/anna?token=wrong").status, 401u);
    publish("right");
    EXPECT_EQ(status(get("/watch/anna")), 403);
    EXPECT_EQ(open("/watch/anna?token=wrong").closing_code(), 1008u);
    EXPECT_TRUE(open("/watch/anna?token=right").next());
    EXPECT_EQ(status(get("/api/streams")), 403);
    const auto asked = service.asked();
    ASSERT_EQ(asked.size(), 6u);
    EXPECT_EQ(asked[1], (nlohmann::json{
                            {"action", "publish"}, {"stream", "anna"}, {"address", "127.0.0.1"}, {"token", "wrong"}}));
    EXPECT_EQ(asked[5],
              (nlohmann::json{{"action", "watch"}, {"stream", "anna"}, {"address", "127.0.0.1"}, {"token", "right"}}));
    EXPECT_TRUE(metrics_come_to(R"(htvm_authority_answers_total{answer="no"} 4)"));
}

TEST_F(AskedServerTest, AnAnswerIsRememberedAsLongAsItHolds) {
    Service service([](const nlohmann::json& question) {
        return std::pair(200u, std::string(question["action"] == "watch" ? "Cache-Control: max-age=60\r\n" : ""));
    });
    options.authority.url = service.url();
    start();
    publish();
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(open("/watch/anna?token=a").next());
    EXPECT_TRUE(open("/watch/anna?token=b").next());
    EXPECT_EQ(service.asked().size(), 3u);  // the publisher, a and b
    publisher.reset();
    EXPECT_EQ(open("/publish/anna").status, 101u);
    EXPECT_EQ(service.asked().size(), 4u);
}

TEST_F(AskedServerTest, WithoutAnAnswerNobodyIsLetIn) {
    std::atomic<unsigned> answer = 0;
    Service service([&](const nlohmann::json&) { return std::pair(answer.load(), std::string("Location: /yes\r\n")); });
    options.authority = {.url = service.url(), .time = std::chrono::milliseconds(200)};
    start();
    EXPECT_EQ(open("/publish/anna?token=a").status, 503u);
    for (const unsigned other : {204u, 302u, 401u, 500u}) {
        answer = other;
        EXPECT_EQ(open("/publish/anna?token=a").status, 503u) << other;
        EXPECT_EQ(open("/watch/anna?token=a").closing_code(), 1013u) << other;
    }
    EXPECT_TRUE(metrics_come_to(R"(htvm_refused_total{cause="authority_silent"} 9)"));
}

TEST_F(AskedServerTest, AServiceThatIsNotThereLetsNobodyIn) {
    options.authority.url = "http://127.0.0.1:1/";
    start();
    EXPECT_EQ(open("/publish/anna?token=a").status, 503u);
}

TEST_F(AskedServerTest, OneByTlsIsBelievedIfItsCertificateIsTrustedAndForItsAddress) {
    const auto certificate = (root / "service.pem").string(), other = (root / "other.pem").string();
    write_certificate(certificate, certificate + ".key", "service", "IP:127.0.0.1");
    write_certificate(other, other + ".key", "service", "IP:127.0.0.2");
    const auto status_by = [&](const std::string& shown, const std::string& trusted) {
        Service service([](const nlohmann::json&) { return std::pair(200u, std::string()); }, shown);
        options.authority.url = service.url();
        ::setenv("SSL_CERT_FILE", trusted.c_str(), 1);
        start();
        ::unsetenv("SSL_CERT_FILE");
        const auto got = open("/publish/anna?token=a").status;
        EXPECT_EQ(service.asked().size(), got == 101u ? 1u : 0u);
        stop();
        return got;
    };
    EXPECT_EQ(status_by(certificate, certificate), 101u);
    EXPECT_EQ(status_by(certificate, other), 503u);
    EXPECT_EQ(status_by(other, other), 503u);
}

TEST_F(AskedServerTest, QuestionsBeyondWhatIsAllowedHaveNoAnswer) {
    Service service([](const nlohmann::json&) { return std::pair(0u, std::string()); });
    options.authority = {.url = service.url(), .time = std::chrono::milliseconds(5000), .at_once = 1, .waiting = 1};
    start();
    const auto ask = [&] {
        auto socket = connect();
        net::write(socket, net::buffer("GET /watch/anna HTTP/1.1\r\nHost: " + host + "\r\n\r\n"));
        return socket;
    };
    const auto asked = ask();
    ASSERT_TRUE(soon([&] { return service.asked().size() == 1; }));
    const auto waiting = ask();
    // Both wait for seconds yet; this one does not.
    auto refused = [&] { return status(get("/watch/anna")); };
    ASSERT_TRUE(soon([&] { return refused() == 503; }));
    EXPECT_EQ(service.asked().size(), 1u);
}

TEST_F(AskedServerTest, ItMayBeAskedForPublishingAlone) {
    Service service([](const nlohmann::json&) { return std::pair(200u, std::string()); });
    options.authority.url = service.url();
    options.admission.guard_watching = false;
    start();
    publish();
    EXPECT_TRUE(open("/watch/anna").next());
    EXPECT_EQ(service.asked().size(), 1u);
    EXPECT_EQ(status(get("/api/streams")), 200);
}

TEST_F(AskedServerTest, APublishersOwnTokenNeedsNoQuestion) {
    Service service([](const nlohmann::json&) { return std::pair(403u, std::string()); });
    options.authority.url = service.url();
    options.admission.publishers = (root / "publishers.json").string();
    const auto token = add_publisher(options.admission.publishers, "anna");
    ASSERT_TRUE(token);
    start();
    publish(*token);
    EXPECT_EQ(service.asked().size(), 0u);
    EXPECT_EQ(open("/publish/anna?token=x").status, 401u);
    EXPECT_EQ(service.asked().size(), 1u);
}

TEST_F(AskedServerTest, ALinkThatIsTakenBackIsOfNoUseOnceTheFileIsReadAgain) {
    options.admission.link_keys = (root / "keys.json").string();
    ASSERT_TRUE(add_link_key(options.admission.link_keys));
    options.admission.revoked = (root / "revoked").string();
    std::ofstream(options.admission.revoked) << "# none yet\n";
    start();
    publish();
    const auto keys = read_link_keys(options.admission.link_keys).value();
    const auto expires = system_clock::now() + std::chrono::seconds(60);
    const auto link = "/watch/anna?" + link_query(keys, "watch/anna", expires, "a1"),
               other = "/watch/anna?" + link_query(keys, "watch/anna", expires, "b2"),
               old = "/watch/anna?" + link_query(keys, "watch/anna", expires);
    EXPECT_TRUE(open(link).next());
    auto without_id = link, of_another = link;
    without_id.erase(link.find("&id=a1"), 6);
    of_another.replace(link.find("a1"), 2, "b2");
    EXPECT_EQ(status(get(without_id)), 403);
    EXPECT_EQ(status(get(of_another)), 403);
    std::ofstream(options.admission.revoked) << "a1\n";
    ASSERT_EQ(std::raise(SIGHUP), 0);
    EXPECT_TRUE(soon([&] { return status(get(link)) == 403; }));
    EXPECT_THAT(body(get(link)), testing::HasSubstr("taken back"));
    EXPECT_TRUE(open(other).next());
    EXPECT_TRUE(open(old).next());
}

}  // namespace
}  // namespace htvm::live
