#include "live/server/admission.h"

#include <algorithm>

#include "core/letter_case.h"
#include "live/hub/stream_name.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;

net::ip::address counted_address(const net::ip::address& address) {
    if (!address.is_v6()) return address;
    auto bytes = address.to_v6().to_bytes();
    if (address.to_v6().is_v4_mapped()) return net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6());
    std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
    return net::ip::address_v6(bytes);
}

using internal::lower_case;

std::string_view host_without_port(std::string_view host) {
    const auto colon = host.rfind(':');
    return colon == std::string_view::npos || host.find(']', colon) != std::string_view::npos ? host
                                                                                              : host.substr(0, colon);
}

bool same_host(std::string_view a, std::string_view b) { return lower_case(a) == lower_case(b); }

// Sites are the same whatever the case of their letters, and with the port that their scheme has anyway or without.
std::string normal_origin(std::string_view origin) {
    auto out = lower_case(origin);
    for (const auto& [scheme, port] : {std::pair("http://", ":80"), std::pair("https://", ":443")})
        if (out.starts_with(scheme) && out.ends_with(port)) out.resize(out.size() - std::string_view(port).size());
    return out;
}

bool is_one_of(const std::vector<std::string>& origins, std::string_view origin) {
    const auto same = [wanted = normal_origin(origin)](const auto& one) { return normal_origin(one) == wanted; };
    return std::any_of(origins.begin(), origins.end(), same);
}

// Whether it is the site that a request with this Host is for. Only the origin tells the scheme.
bool names_origin(std::string_view origin, std::string_view host) {
    const auto name = host_of_origin(origin);
    if (name.empty()) return false;
    const std::string scheme(origin.substr(0, origin.size() - name.size()));
    return normal_origin(origin) == normal_origin(scheme + std::string(host));
}

}  // namespace

std::string shown_token(const Request& request) {
    auto token = std::string(bearer_token(request[http::field::authorization]));
    return token.empty() ? query_value(request.target(), "token").value_or("") : token;
}

bool is_loopback(const std::string& address) {
    boost::system::error_code error;
    const auto parsed = net::ip::make_address(address, error);
    return !error && counted_address(parsed).is_loopback();
}

Result<Credentials> read_credentials(const AdmissionOptions& options) {
    Credentials out;
    if (!options.publishers.empty()) {
        auto publishers = read_publishers(options.publishers);
        if (!publishers) return tl::unexpected(publishers.error());
        out.publishers = std::move(*publishers);
    }
    if (!options.link_keys.empty()) {
        auto keys = read_link_keys(options.link_keys);
        if (!keys) return tl::unexpected(keys.error());
        out.link_keys = std::move(*keys);
    }
    if (!options.web_token_keys.empty()) {
        auto keys = read_web_token_keys(options.web_token_keys);
        if (!keys) return tl::unexpected(keys.error());
        out.web_token_keys = std::move(*keys);
    }
    if (!options.revoked.empty()) {
        auto revoked = read_revocations(options.revoked);
        if (!revoked) return tl::unexpected(revoked.error());
        out.revoked = std::move(*revoked);
    }
    return out;
}

AddressCounts::Place::Place(AddressCounts& counts, const net::ip::address& address)
    : counts_(&counts), address_(counted_address(address)) {
    ++counts_->counts_[address_];
    ++counts_->total_;
}

AddressCounts::Place::~Place() {
    if (!counts_) return;
    const auto found = counts_->counts_.find(address_);
    if (--found->second == 0) counts_->counts_.erase(found);
    --counts_->total_;
}

unsigned AddressCounts::at(const net::ip::address& address) const {
    const auto found = counts_.find(counted_address(address));
    return found == counts_.end() ? 0 : found->second;
}

std::optional<AddressCounts::Place> Admission::admit_connection(const Address& address, bool of_proxy) {
    if (connections_.total() >= options_.connections) return std::nullopt;
    if (!of_proxy && connections_.at(address) >= options_.connections_per_address) return std::nullopt;
    return AddressCounts::Place(connections_, address);
}

std::optional<AddressCounts::Place> Admission::admit_behind_proxy(const Address& address) {
    if (behind_proxies_.at(address) >= options_.connections_per_address) return std::nullopt;
    return AddressCounts::Place(behind_proxies_, address);
}

// A page of another site whose name was made to point here (DNS rebinding) sends that name.
bool Admission::host_allowed(const Request& request) const {
    if (!options_.loopback_names && options_.hosts.empty()) return true;
    const auto host = request[http::field::host];
    if (names_loopback(host, port_)) return true;
    const auto named = [&](const std::string& name) { return same_host(host_without_port(host), name); };
    return std::any_of(options_.hosts.begin(), options_.hosts.end(), named);
}

// Whether a page, if it is one that asks, may do so; other programs name no origin.
bool Admission::origin_allowed(const Request& request) const {
    const auto origin = request[http::field::origin];
    if (origin.empty() || names_origin(origin, request[http::field::host])) return true;
    if (options_.origins.empty()) return options_.other_sites;
    return is_one_of(options_.origins, origin);
}

// Whether it comes from a program on this machine. A web page in a browser here is somebody else, and so is who comes
// through a web server here.
bool Admission::by_program_here(const Request& request, const Client& client) const {
    const auto origin = request[http::field::origin];
    const bool page_elsewhere = !origin.empty() && !names_loopback(host_of_origin(origin), port_);
    const bool forwarded = request.count("Forwarded") || request.count("X-Forwarded-For") || request.count("Via");
    return counted_address(client.address).is_loopback() && !client.by_proxy && !page_elsewhere && !forwarded;
}

// Nothing if it is no web token, or none are taken.
std::optional<WebTokenCheck> Admission::check_token(std::string_view token, const char* action,
                                                    std::string_view stream) const {
    if (!credentials_.web_token_keys || !looks_like_web_token(token)) return std::nullopt;
    return check_web_token(*credentials_.web_token_keys, credentials_.revoked, token,
                           {.action = action, .stream = ladder_of(stream), .audience = options_.web_token_audience},
                           std::chrono::system_clock::now());
}

std::optional<Refusal> Admission::refuse_publishing(const Request& request, const std::string& stream,
                                                    const Client& client) const {
    if (!is_stream_name(stream)) return Refusal{"name", stream_name_rule, http::status::bad_request};
    if (!origin_allowed(request)) return Refusal{"origin", "pages of this site may not publish here"};
    const bool authority = options_.authority && options_.guard_publishing;
    const bool web_tokens = credentials_.web_token_keys && options_.guard_publishing;
    if (!authority && !web_tokens && !credentials_.publishers) {
        if (by_program_here(request, client)) return std::nullopt;
        return Refusal{"token", "this hub knows no publishers: only programs on its own machine may publish"};
    }
    const auto token = shown_token(request);
    if (credentials_.publishers && !token.empty() && may_publish(*credentials_.publishers, ladder_of(stream), token))
        return std::nullopt;
    const auto check = web_tokens ? check_token(token, "publish", stream) : std::nullopt;
    if (check == WebTokenCheck::good) return std::nullopt;
    const char* why = token.empty() ? "publishing needs a token: Authorization: Bearer TOKEN"
                      : check       ? web_token_sentence(*check)
                                    : "this token is not that of the stream's publisher";
    return Refusal{.cause = "token",
                   .why = why,
                   .status = http::status::unauthorized,
                   .delay = options_.refusal_delay,
                   .may_be_asked = authority && check != WebTokenCheck::revoked};
}

std::optional<Refusal> Admission::refuse_watching(const Request& request, const std::string& stream,
                                                  bool socket) const {
    if (socket && !origin_allowed(request)) return Refusal{"origin", "pages of this site may not watch here"};
    return refuse_without_token(request, stream, refuse_path("watch/" + std::string(ladder_of(stream)), request));
}

std::optional<Refusal> Admission::refuse_segments(const Request& request, const std::string& stream,
                                                  std::string_view link) const {
    return refuse_without_token(request, stream, refuse_link("hls/" + std::string(ladder_of(stream)), link));
}

std::optional<Refusal> Admission::refuse_without_token(const Request& request, const std::string& stream,
                                                       std::optional<Refusal> by_link) const {
    if (!guards_watching() || (asks_for_links() && !by_link)) return by_link;
    const auto token = shown_token(request);
    const auto check = check_token(token, "watch", stream);
    if (check == WebTokenCheck::good) return std::nullopt;
    const bool by_token = check || !by_link;
    Refusal out = by_token ? Refusal{"token", check ? web_token_sentence(*check)
                                                    : "watching needs a token: Authorization: Bearer TOKEN, or ?token="}
                           : std::move(*by_link);
    out.may_be_asked = options_.authority && out.cause != "link_revoked" && check != WebTokenCheck::revoked;
    return out;
}

tl::expected<AddressCounts::Place, Refusal> Admission::place_for_viewer(const Client& client) {
    if (viewers_.at(client.address) >= options_.viewers_per_address)
        return tl::unexpected(Refusal{"address", "this address has as many viewers as it may",
                                      http::status::service_unavailable, CloseCode::try_later});
    return AddressCounts::Place(viewers_, client.address);
}

tl::expected<AddressCounts::Place, Refusal> Admission::admit_viewer(const Request& request, const std::string& stream,
                                                                    bool socket, const Client& client) {
    if (auto refusal = refuse_watching(request, stream, socket)) return tl::unexpected(std::move(*refusal));
    return place_for_viewer(client);
}

std::optional<Refusal> Admission::refuse_path(const std::string& path, const Request& request) const {
    return refuse_link(path, request.target());
}

std::optional<Refusal> Admission::refuse_link(const std::string& path, std::string_view target) const {
    if (!credentials_.link_keys) return std::nullopt;
    const auto check =
        check_link(*credentials_.link_keys, path, target, std::chrono::system_clock::now(), credentials_.revoked);
    if (check == LinkCheck::good) return std::nullopt;
    const char* cause = check == LinkCheck::missing   ? "link_missing"
                        : check == LinkCheck::expired ? "link_expired"
                        : check == LinkCheck::revoked ? "link_revoked"
                                                      : "link_forged";
    return Refusal{cause, link_sentence(check)};
}

std::optional<Refusal> Admission::refuse_lists() const {
    if (asks_for_links()) return Refusal{"link_missing", "this hub tells nobody what there is: it asks for links"};
    if (guards_watching()) return Refusal{"token", "this hub tells nobody what there is: it asks for tokens"};
    return std::nullopt;
}

bool Admission::may_read_metrics(const Request& request, const Client& client) const {
    return options_.metrics_anyone || by_program_here(request, client);
}

void Admission::let_others_read(const Request& request, ResponseHeader& header) const {
    if (options_.origins.empty()) {
        if (options_.other_sites) header.set(http::field::access_control_allow_origin, "*");
        return;
    }
    header.set(http::field::vary, "Origin");
    const auto origin = request[http::field::origin];
    if (is_one_of(options_.origins, origin)) header.set(http::field::access_control_allow_origin, origin);
}

}  // namespace htvm::live
