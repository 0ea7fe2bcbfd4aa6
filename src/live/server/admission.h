// Who may: which connections are let in, which requests are answered, who publishes and who watches. A request is
// judged by where it comes from (its address, and the host and the origin that it names) and by what it shows: a token
// or a link (live/server/credentials.h, live/server/web_token.h). Where these do not let it in and there is an
// authority (live/server/authority.h), the refusal says that it may be asked. What is answered and how is no business
// of this file.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "htvm/result.hpp"
#include "live/files/http_request.h"
#include "live/files/response.h"
#include "live/server/credentials.h"
#include "live/server/refusals.h"
#include "live/server/revocations.h"
#include "live/server/trusted_proxies.h"
#include "live/server/web_token.h"

namespace htvm::live {

struct AdmissionOptions {
    bool other_sites = false;            // whether pages of any other site may read the streams (CORS, WebSockets),
    std::vector<std::string> origins{};  // or, if there are any, those of these sites alone: "https://a.example"
    // Requests must be for one of these hosts, or this machine's loopback address: a page of another site could have
    // its own name lead here. Empty, and loopback_names false: for any.
    std::vector<std::string> hosts{};  // "hub.example", of any port
    bool loopback_names = false;
    unsigned connections = 512;  // at once; more are closed
    unsigned connections_per_address = 64;
    unsigned viewers_per_address = 64;      // of live streams
    std::chrono::seconds refusal_delay{1};  // for who publishes by a wrong token, so that many cannot be tried
    bool metrics_anyone = false;            // /metrics for everybody, not for programs on this machine alone
    // Files (live/server/credentials.h).
    std::string publishers{};  // who may publish what; "": programs on this machine, anything
    std::string link_keys{};   // of links, without which nothing can be watched; "": anyone may watch
    std::string revoked{};     // links and web tokens that were taken back; "": none (live/server/revocations.h)
    // Public keys of web tokens (live/server/web_token.h), which let publish and watch besides; "": there are none. The
    // audience that they must name; "": they must name none.
    std::string web_token_keys{}, web_token_audience{};
    bool authority = false;  // there is one, which may let publish and watch besides
    // What web tokens and the authority are for. What they are not for is decided by the rest, as if there were none.
    bool guard_publishing = true, guard_watching = true;
};

// The token that a request shows: in its header Authorization, or else as ?token=; "" if none.
std::string shown_token(const Request& request);

// Whether what listens on this address can be reached from this machine alone.
bool is_loopback(const std::string& address);

// What the files say.
struct Credentials {
    std::optional<Publishers> publishers{};  // none: programs on this machine
    std::optional<LinkKeys> link_keys{};     // none: anyone may watch
    std::optional<WebTokenKeys> web_token_keys{};
    Revocations revoked{};
};
// bad_input if one of the files is not as it should be.
Result<Credentials> read_credentials(const AdmissionOptions& options);

// How many there are from each address. An IPv6 network /64 counts as one address: that is what one customer has at
// least.
class AddressCounts {
public:
    // One of them, for as long as this lives. The counts must live longer.
    class Place {
    public:
        Place(AddressCounts& counts, const boost::asio::ip::address& address);
        Place(Place&& other) noexcept : counts_(std::exchange(other.counts_, nullptr)), address_(other.address_) {}
        Place& operator=(Place&&) = delete;
        ~Place();

    private:
        AddressCounts* counts_;  // null: moved from
        boost::asio::ip::address address_;
    };

    unsigned at(const boost::asio::ip::address& address) const;
    unsigned total() const { return total_; }

private:
    std::map<boost::asio::ip::address, unsigned> counts_;  // none that are 0
    unsigned total_ = 0;
};

class Admission {
public:
    using Address = boost::asio::ip::address;

    // Until use() nobody but programs on this machine may publish, and everybody may watch.
    explicit Admission(const AdmissionOptions& options) : options_(options) {}
    Admission(const Admission&) = delete;
    Admission& operator=(const Admission&) = delete;

    // From here on these credentials decide.
    void use(Credentials credentials) { credentials_ = std::move(credentials); }
    // The server's port, which requests may name behind the host.
    void listens_on(std::uint16_t port) { port_ = port; }

    // A place for another connection from this address; none if there are too many, from it or in all. of_proxy: it
    // may have as many as there may be in all.
    std::optional<AddressCounts::Place> admit_connection(const Address& address, bool of_proxy = false);
    // Likewise for whom a proxy connects.
    std::optional<AddressCounts::Place> admit_behind_proxy(const Address& address);
    unsigned connections() const { return connections_.total(); }

    // Whether the request is for this server by a name that it may be called by.
    bool host_allowed(const Request& request) const;

    // Why somebody may not publish the stream, if so.
    std::optional<Refusal> refuse_publishing(const Request& request, const std::string& stream,
                                             const Client& client) const;
    // Why somebody may not watch the stream, if so. socket: they ask for a WebSocket.
    std::optional<Refusal> refuse_watching(const Request& request, const std::string& stream, bool socket) const;
    // Likewise its segments. link: as a target with a query; or "".
    std::optional<Refusal> refuse_segments(const Request& request, const std::string& stream,
                                           std::string_view link) const;
    // Whether watching takes a token or is asked for: links are another thing.
    bool guards_watching() const {
        return options_.guard_watching && (credentials_.web_token_keys || options_.authority);
    }
    // A place for another viewer who may watch.
    tl::expected<AddressCounts::Place, Refusal> place_for_viewer(const Client& client);
    // Both.
    tl::expected<AddressCounts::Place, Refusal> admit_viewer(const Request& request, const std::string& stream,
                                                             bool socket, const Client& client);
    // Why the request may not read what is at this path, such as "files/anna.htvm", if so: there is need of a link.
    std::optional<Refusal> refuse_path(const std::string& path, const Request& request) const;
    // Why nobody may read what streams there are, if so.
    std::optional<Refusal> refuse_lists() const;
    bool may_read_metrics(const Request& request, const Client& client) const;

    // Whether pages of other sites, of all or some, may read what is here.
    bool has_other_sites() const { return options_.other_sites || !options_.origins.empty(); }
    // Tells the browser whether pages of other sites may read the response (CORS).
    void let_others_read(const Request& request, ResponseHeader& header) const;

private:
    std::optional<Refusal> refuse_link(const std::string& path, std::string_view target) const;
    bool by_program_here(const Request& request, const Client& client) const;
    bool origin_allowed(const Request& request) const;
    bool asks_for_links() const { return credentials_.link_keys.has_value(); }
    std::optional<Refusal> refuse_without_token(const Request& request, const std::string& stream,
                                                std::optional<Refusal> by_link) const;
    std::optional<WebTokenCheck> check_token(std::string_view token, const char* action, std::string_view stream) const;

    AdmissionOptions options_;
    Credentials credentials_;
    std::uint16_t port_ = 0;
    AddressCounts connections_, behind_proxies_, viewers_;
};

}  // namespace htvm::live
