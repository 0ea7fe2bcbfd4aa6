// In place of all that connects to hubs and web servers where there is no OpenSSL.
#include "htvm/publisher.hpp"
#include "htvm/watcher.hpp"
#include "live/client/http_client.h"

namespace htvm {
namespace {

tl::unexpected<Error> without_lines(const char* what) {
    return fail(ErrorKind::unsupported, std::string("this htvm was built without live streams, so it cannot ") + what);
}

}  // namespace

struct Publisher::State {};
Publisher::Publisher(Publisher&&) noexcept = default;
Publisher& Publisher::operator=(Publisher&&) noexcept = default;
Publisher::~Publisher() = default;
Result<Publisher> Publisher::open(const std::string&, const PublisherOptions&) { return without_lines("publish"); }
Result<void> Publisher::send(const Packet&) { return without_lines("publish"); }
bool Publisher::wants_key_frame() { return false; }
PublisherState Publisher::state() const { return {}; }
Result<void> Publisher::finish(std::chrono::milliseconds) { return without_lines("publish"); }
Result<void> Publisher::leave(std::chrono::milliseconds) { return without_lines("publish"); }

struct Watcher::State {};
Watcher::Watcher(Watcher&&) noexcept = default;
Watcher& Watcher::operator=(Watcher&&) noexcept = default;
Watcher::~Watcher() = default;
Result<Watcher> Watcher::open(const std::string&, const WatcherOptions&) { return without_lines("watch"); }
Result<std::optional<Packet>> Watcher::next() { return without_lines("watch"); }
Result<std::optional<Packet>> Watcher::next(std::chrono::milliseconds) { return without_lines("watch"); }
void Watcher::stop() {}
WatcherState Watcher::state() const { return {}; }

namespace live {

struct HttpClient::State {};
HttpClient::HttpClient(HttpClient&&) noexcept = default;
HttpClient& HttpClient::operator=(HttpClient&&) noexcept = default;
HttpClient::~HttpClient() = default;
Result<HttpClient> HttpClient::create(const HttpClientOptions&) { return without_lines("read from web servers"); }
Result<HttpAnswer> HttpClient::get(const HubAddress&, std::size_t) { return without_lines("read from web servers"); }

}  // namespace live
}  // namespace htvm
