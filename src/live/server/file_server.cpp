#include "live/server/file_server.h"

#include <netinet/tcp.h>

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/zlib/deflate_stream.hpp>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "core/crc32.h"
#include "live/client/control.h"
#include "live/server/access.h"
#include "live/server/http_request.h"
#include "live/server/live_connection.h"
#include "live/server/metrics.h"
#include "live/server/player_files.h"
#include "live/server/recorder.h"
#include "live/server/served_folder.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = net::ip::tcp;

constexpr std::size_t header_limit = 8192, piece_bytes = 65536;
constexpr const char* json_type = "application/json";
constexpr std::uint64_t most_told_refusals = 10;  // a second, in the log
constexpr auto awaited = net::as_tuple(net::use_awaitable);

// What the player's pages may do; inline scripts and other sites' are forbidden.
constexpr const char* page_policy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; connect-src "
    "'self' ws: wss:; "  // a live stream's other hubs
    "img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view media_type(std::string_view name) {
    const std::pair<std::string_view, std::string_view> types[] = {
        {".html", "text/html; charset=utf-8"},
        {".js", "text/javascript; charset=utf-8"},
        {".css", "text/css; charset=utf-8"},
        {".txt", "text/plain; charset=utf-8"},
        {".wasm", "application/wasm"},
        {".json", "application/json"},
        {".png", "image/png"},
        {".jpg", "image/jpeg"},
    };
    for (const auto& [ending, type] : types)
        if (name.ends_with(ending)) return type;
    return "application/octet-stream";
}

std::string gzipped(std::string_view content) {
    std::string out = {'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, 3};
    beast::zlib::deflate_stream deflate;
    deflate.reset(6, 15, 8, beast::zlib::Strategy::normal);
    const std::size_t begin = out.size();
    out.resize(begin + deflate.upper_bound(content.size()) + 16);
    beast::zlib::z_params params;
    params.next_in = content.data();
    params.avail_in = content.size();
    params.next_out = out.data() + begin;
    params.avail_out = out.size() - begin;
    beast::error_code error;
    deflate.write(params, beast::zlib::Flush::finish, error);
    out.resize(begin + params.total_out);
    const auto crc = internal::crc32({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});
    for (const auto value : {crc, static_cast<std::uint32_t>(content.size())})
        for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(value >> shift));
    return out;
}

// A file of the player, or a text made for a request.
struct Text {
    std::string_view type;
    std::string content, compressed, tag;
};

Text make_text(std::string_view name, std::string content) {
    Text out{media_type(name), std::move(content), {}, {}};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(out.content.data());
    out.tag = '"' + std::to_string(internal::crc32({bytes, out.content.size()})) + '"';
    out.compressed = gzipped(out.content);
    return out;
}

using Request = http::request<http::empty_body>;
using Header = http::response<http::empty_body>;

// A file by its path, which may change meanwhile as those of a folder may; symbolic links are not followed.
Result<ServedFile> file_at(const std::filesystem::path& path) {
    const auto folder = ServedFolder::open(path.parent_path().string());
    if (!folder) return tl::unexpected(folder.error());
    const std::vector<std::string> name = {path.filename().string()};
    return folder->file(name);
}

struct Response {
    Header header;
    std::string own;           // a text made for this response,
    std::string_view content;  // or one that outlives it,
    ServedFile file;           // or a part of a file
    std::uint64_t first = 0, count = 0;
};

// To publish or watch one live stream.
struct LiveTarget {
    bool publish = false;
    bool socket = false;  // whether by a WebSocket
    std::string name;
};

// Why a request is not answered as its sender wishes.
struct Refusal {
    std::string cause;  // a word, to count by
    std::string why;    // a sentence for the other side
    http::status status = http::status::forbidden;
    CloseCode code = CloseCode::refused;  // instead, of a WebSocket that is opened only to say why
};

void say_why(Response& response, const Refusal& refusal) {
    response.header.result(refusal.status);
    response.header.set(http::field::content_type, "text/plain; charset=utf-8");
    response.header.set(http::field::cache_control, "no-store");
    response.own = refusal.why + '\n';
}

// Who may do what, as the files say.
struct Access {
    std::optional<Publishers> publishers;  // none: programs on this machine
    std::optional<LinkKeys> link_keys;     // none: anyone may watch
    std::optional<net::ssl::context> tls;
};

Result<Access> read_access(const FileServerOptions& options) {
    Access out;
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
    if (!options.certificate.empty()) {
        auto tls = server_context(options.certificate, options.private_key);
        if (!tls) return tl::unexpected(tls.error());
        out.tls = std::move(*tls);
    }
    return out;
}

// What counts as one address: of IPv6 a network of 2^64, which is what one customer has at least.
net::ip::address counted_address(const net::ip::address& address) {
    if (!address.is_v6()) return address;
    auto bytes = address.to_v6().to_bytes();
    if (address.to_v6().is_v4_mapped()) return net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6());
    std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
    return net::ip::address_v6(bytes);
}

// One more at this place of a table of counts, as long as this lives. Entries of none are removed.
class Counted {
public:
    using Counts = std::map<net::ip::address, unsigned>;
    Counted(Counts& counts, const net::ip::address& address) : counts_(counts), address_(address) {
        ++counts_[address_];
    }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    ~Counted() {
        if (--counts_[address_] == 0) counts_.erase(address_);
    }

private:
    Counts& counts_;
    net::ip::address address_;
};

// What goes to the viewers of the hub's streams is recorded.
void record(Hub& hub, Recorder& recorder) {
    const auto sent = [&](const std::string& stream, const SharedPacket& packet, Hub::Clock::time_point now) {
        if (recorder.take(stream, packet, now, std::chrono::system_clock::now())) hub.ask_for_key_frame(stream, now);
    };
    hub.listen({.sent = sent, .ended = [&](const std::string& stream) { recorder.end(stream); }});
}

}  // namespace

struct FileServer::State {
    FileServerOptions options;
    std::optional<ServedFolder> folder;  // unless there are files with names
    Counted::Counts by_address, viewers_by_address;
    net::io_context context{1};  // what its coroutines count by lives longer
    tcp::acceptor acceptor{context};
    std::optional<NatsLink> nats;  // if the hub is joined with others
    std::uint16_t port = 0;
    std::map<std::string, Text, std::less<>> player;
    unsigned connections = 0;
    Access access;
    std::set<Line*> idle;  // that wait for a request
    bool draining = false;
    const Hub::Clock::time_point started = Hub::Clock::now();
    std::map<std::string, std::uint64_t> refused{{"connections", 0}};  // how many, by cause
    std::uint64_t refusals = 0;                                        // in this second
    std::size_t told_joined = 0, told_watching = 0;                    // viewers, as the log says

    explicit State(const FileServerOptions& given) : options(given) {}

    Header common_header() const;
    Response answer(const Request& request, const net::ip::address& address);
    Response answer_file(const Request& request, std::vector<std::string> segments, Header header);
    Response answer_text(const Request& request, const Text& text, Header header);
    Response answer_own(std::string text, const char* type, Header header) const;
    std::string metrics() const;
    std::string listing() const;
    std::string live_listing() const;
    Result<ServedFile> served_file(const std::vector<std::string>& segments) const;
    bool host_is_loopback(std::string_view host) const;
    bool by_program_here(const Request& request, const net::ip::address& address) const;

    bool origin_allowed(const Request& request) const;
    void let_others_read(const Request& request, Header& header) const;
    std::string publishing_refused(const Request& request, const LiveTarget& target,
                                   const net::ip::address& address) const;
    std::optional<Refusal> link_refused(const std::string& path, const Request& request) const;
    void tell_refused(const Refusal& refusal, const std::string& stream, const net::ip::address& address);
    void tell_too_slow(const net::ip::address& address);
    void tell(const Event& event) const {
        if (options.log) options.log(event);
    }

    net::awaitable<void> accept();
    net::awaitable<void> serve(Line line, net::ip::address address);
    net::awaitable<std::optional<std::pair<Request, LiveTarget>>> answer_requests(Line& line,
                                                                                  const net::ip::address& address);
    std::optional<LiveTarget> live_target(const Request& request) const;
    net::awaitable<void> publish(Line line, Request request, LiveTarget target, net::ip::address address);
    net::awaitable<void> watch(Line line, Request request, LiveTarget target, net::ip::address address);
    net::awaitable<void> refuse(Line line, Header header, Refusal refusal);
    net::awaitable<void> tick_hub();
    void tell_viewers();
    net::awaitable<void> each_second();
    net::awaitable<void> reload_on_hangup();
    net::awaitable<void> drain_on_signal();
    net::awaitable<bool> send(Line& line, Response& response, bool with_body);
};

// segments: below /files/.
Result<ServedFile> FileServer::State::served_file(const std::vector<std::string>& segments) const {
    std::string path;
    for (const auto& segment : segments) path += (path.empty() ? "" : "/") + segment;
    for (const auto& [name, place] : options.files)
        if (name == path) return file_at(place);
    const bool watched = path.ends_with(".htvm") || path.ends_with(".png") || path.ends_with(".jpg");
    return folder && watched ? folder->file(segments) : fail(ErrorKind::bad_input, "not served");
}

// A page of another site whose name was made to point here (DNS rebinding) sends that name.
bool FileServer::State::host_is_loopback(std::string_view host) const {
    const auto suffix = ':' + std::to_string(port);
    if (host.ends_with(suffix)) host.remove_suffix(suffix.size());
    return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

std::string FileServer::State::listing() const {
    nlohmann::json list = nlohmann::json::array();
    std::set<std::string> pictures;
    for (const char* ending : {".png", ".jpg"})
        for (const auto& [path, size] : folder ? folder->files(ending) : std::vector<FolderEntry>())
            pictures.insert(path);
    for (const auto& [path, size] : folder ? folder->files(".htvm") : std::vector<FolderEntry>()) {
        nlohmann::json entry = {{"path", path}, {"bytes", size}};
        const auto name = path.substr(0, path.size() - std::string_view(".htvm").size());
        for (const char* ending : {".jpg", ".png"})
            if (pictures.contains(name + ending)) entry["poster"] = name + ending;
        list.push_back(std::move(entry));
    }
    for (const auto& [name, path] : options.files)
        if (const auto file = file_at(path)) list.push_back({{"path", name}, {"bytes", file->size}});
    // File names may be any bytes.
    return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string FileServer::State::live_listing() const {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& stream : options.hub->streams(Hub::Clock::now())) {
        nlohmann::json entry = {{"name", stream.name},
                                {"published", stream.published},
                                {"far", stream.far},
                                {"viewers", stream.viewers},
                                {"viewers_afar", stream.viewers_afar},
                                {"packets", stream.publisher.packets},
                                {"bytes", stream.publisher.bytes},
                                {"damaged_messages", stream.publisher.damaged},
                                {"undecodable_frames", stream.undecodable_frames},
                                {"dropped_frames", stream.dropped_frames}};
        if (stream.header) {
            if (stream.header->session != 0) entry["session"] = session_text(stream.header->session);
            entry["frames_per_second"] =
                static_cast<double>(stream.header->fps_numerator) / static_cast<double>(stream.header->fps_denominator);
        }
        if (stream.clock) entry["clock"] = *stream.clock;
        if (stream.since_packet)
            entry["seconds_since_packet"] = static_cast<double>(stream.since_packet->count()) / 1000;
        list.push_back(std::move(entry));
    }
    return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Response FileServer::State::answer_text(const Request& request, const Text& text, Header header) {
    Response out;
    out.header = std::move(header);
    out.header.set(http::field::etag, text.tag);
    out.header.set(http::field::cache_control, "no-cache");
    out.header.set(http::field::vary, "Accept-Encoding");
    if (text.type.starts_with("text/html")) out.header.set("Content-Security-Policy", page_policy);
    if (names_tag(request[http::field::if_none_match], text.tag)) {
        out.header.result(http::status::not_modified);
        return out;
    }
    const bool gzip = accepts_gzip(request[http::field::accept_encoding]);
    if (gzip) out.header.set(http::field::content_encoding, "gzip");
    out.header.set(http::field::content_type, text.type);
    out.content = gzip ? text.compressed : text.content;
    return out;
}

Response FileServer::State::answer_file(const Request& request, std::vector<std::string> segments, Header header) {
    Response out;
    out.header = std::move(header);
    std::string path = "files";
    segments.erase(segments.begin());
    for (const auto& segment : segments) path += '/' + segment;
    let_others_read(request, out.header);
    if (out.header.count(http::field::access_control_allow_origin))
        out.header.set(http::field::access_control_expose_headers, "Content-Range, ETag");
    if (const auto refusal = link_refused(path, request)) {
        ++refused[refusal->cause];
        say_why(out, *refusal);
        return out;
    }
    auto file = served_file(segments);
    if (!file) {
        out.header.result(http::status::not_found);
        return out;
    }
    out.header.set(http::field::etag, file->tag);
    out.header.set(http::field::accept_ranges, "bytes");
    out.header.set(http::field::cache_control, "no-cache");  // kept, but asked for again whether it is still the same
    if (names_tag(request[http::field::if_none_match], file->tag)) {
        out.header.result(http::status::not_modified);
        return out;
    }
    const auto condition = request[http::field::if_range];
    const bool ranges = condition.empty() || condition == file->tag;
    const auto part = requested_part(ranges ? request[http::field::range] : "", file->size);
    if (part.kind == FilePart::Kind::beyond) {
        out.header.result(http::status::range_not_satisfiable);
        out.header.set(http::field::content_range, "bytes */" + std::to_string(file->size));
        return out;
    }
    if (part.kind == FilePart::Kind::part) {
        out.header.result(http::status::partial_content);
        out.header.set(http::field::content_range, "bytes " + std::to_string(part.first) + '-' +
                                                       std::to_string(part.first + part.count - 1) + '/' +
                                                       std::to_string(file->size));
    }
    out.header.set(http::field::content_type, media_type(segments.back()));
    out.file = std::move(*file);
    out.first = part.first;
    out.count = part.count;
    return out;
}

Response FileServer::State::answer_own(std::string text, const char* type, Header header) const {
    Response out;
    out.header = std::move(header);
    out.own = std::move(text);
    out.header.set(http::field::content_type, type);
    out.header.set(http::field::cache_control, "no-store");
    return out;
}

std::string FileServer::State::metrics() const {
    return metrics_text({.hub = options.hub,
                         .recorder = options.recorder,
                         .nats = nats ? std::optional(nats->counters()) : std::nullopt,
                         .refused = refused,
                         .connections = connections,
                         .started = started},
                        Hub::Clock::now());
}

// What every response has.
Header FileServer::State::common_header() const {
    Header header{http::status::ok, 11};
    header.set("X-Content-Type-Options", "nosniff");
    header.set("Referrer-Policy", "no-referrer");
    const bool others = options.other_sites || !options.origins.empty();
    header.set("Cross-Origin-Resource-Policy", others ? "cross-origin" : "same-origin");
    return header;
}

Response FileServer::State::answer(const Request& request, const net::ip::address& address) {
    Header header = common_header();
    const auto refuse = [&](http::status status) {
        header.result(status);
        Response out;
        out.header = header;
        return out;
    };
    if (options.loopback_names && !host_is_loopback(request[http::field::host]))
        return refuse(http::status::misdirected_request);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
        header.set(http::field::allow, "GET, HEAD");
        return refuse(http::status::method_not_allowed);
    }
    auto segments = path_segments(request.target());
    if (!segments) return refuse(http::status::bad_request);
    const auto& path = *segments;
    if (path.size() > 1 && path[0] == "files") return answer_file(request, std::move(*segments), header);
    if (path.size() == 1 && path[0] == "healthz") {
        if (draining) header.result(http::status::service_unavailable);
        return answer_own(draining ? "ending\n" : "ok\n", "text/plain; charset=utf-8", header);
    }
    if (path.size() == 1 && path[0] == "metrics")
        return options.metrics_anyone || by_program_here(request, address) ? answer_own(metrics(), metrics_type, header)
                                                                           : refuse(http::status::forbidden);
    const bool list = path.size() == 2 && path[0] == "api" && (path[1] == "files" || path[1] == "streams");
    if (list && access.link_keys) {
        Response out;
        out.header = header;
        say_why(out, {"link_missing", "this hub tells nobody what there is: it asks for links"});
        return out;
    }
    if (path.size() == 2 && path[0] == "api" && path[1] == "files") return answer_own(listing(), json_type, header);
    if (path.size() == 2 && path[0] == "api" && path[1] == "streams")
        return answer_own(options.hub ? live_listing() : "null", json_type, header);
    // /play/NAME: the page finds the live stream of that name by itself.
    const bool page = path.empty() || (path.size() == 2 && path[0] == "play" && options.hub);
    const bool script = path.size() == 2 && path[0] == "player";
    const auto found = player.find(page ? "index.html" : script ? path[1] : "");
    if (found == player.end()) return refuse(http::status::not_found);
    return answer_text(request, found->second, header);
}

// False if the connection is of no use any more.
net::awaitable<bool> FileServer::State::send(Line& line, Response& response, bool with_body) {
    auto& header = response.header;
    if (!response.own.empty()) response.content = response.own;
    const bool text = response.file.file.descriptor() < 0;
    const auto count = text ? response.content.size() : response.count;
    if (header.result() != http::status::not_modified) header.set(http::field::content_length, std::to_string(count));
    http::response_serializer<http::empty_body> serializer(header);
    line.next_layer().expires_after(options.stall_time);
    if (const auto [error, bytes] = co_await http::async_write_header(line, serializer, awaited); error)
        co_return false;
    if (!with_body) co_return true;
    std::vector<char> piece(text ? 0 : std::min<std::uint64_t>(piece_bytes, count));
    for (std::uint64_t sent = 0; sent < count;) {
        std::string_view next;
        if (text) {
            next = response.content.substr(sent, piece_bytes);
        } else {
            const auto wanted = std::min<std::uint64_t>(piece.size(), count - sent);
            next = {piece.data(), response.file.file.read(response.first + sent, {piece.data(), wanted})};
        }
        if (next.empty()) co_return false;  // the file has become shorter than was promised
        line.next_layer().expires_after(options.stall_time);
        const auto [error, bytes] = co_await net::async_write(line, net::buffer(next), awaited);
        if (error) co_return false;
        sent += bytes;
    }
    co_return true;
}

// What the request wants of a live stream, unless it is for something else.
std::optional<LiveTarget> FileServer::State::live_target(const Request& request) const {
    auto path = path_segments(request.target());
    if (!options.hub || !path || path->size() != 2) return std::nullopt;
    if (options.loopback_names && !host_is_loopback(request[http::field::host])) return std::nullopt;
    const bool socket = beast::websocket::is_upgrade(request);
    const bool publish = (*path)[0] == "publish", watch = (*path)[0] == "watch";
    if (!(publish && socket) && !(watch && request.method() == http::verb::get)) return std::nullopt;
    return LiveTarget{publish, socket, std::move((*path)[1])};
}

// Whether a page, if it is one that asks, may do so; other programs name no origin.
bool FileServer::State::origin_allowed(const Request& request) const {
    const auto origin = request[http::field::origin];
    if (origin.empty() || host_of_origin(origin) == request[http::field::host]) return true;
    if (options.origins.empty()) return options.other_sites;
    return std::find(options.origins.begin(), options.origins.end(), origin) != options.origins.end();
}

// Tells the browser whether pages of other sites may read the response (CORS).
void FileServer::State::let_others_read(const Request& request, Header& header) const {
    if (options.origins.empty()) {
        if (options.other_sites) header.set(http::field::access_control_allow_origin, "*");
        return;
    }
    header.set(http::field::vary, "Origin");
    const auto origin = request[http::field::origin];
    if (std::find(options.origins.begin(), options.origins.end(), origin) != options.origins.end())
        header.set(http::field::access_control_allow_origin, origin);
}

// Whether it comes from a program on this machine. A web page in a browser here is somebody else, and so is who comes
// through a web server here.
bool FileServer::State::by_program_here(const Request& request, const net::ip::address& address) const {
    const auto origin = request[http::field::origin];
    const bool page_elsewhere = !origin.empty() && !host_is_loopback(host_of_origin(origin));
    const bool forwarded = request.count("Forwarded") || request.count("X-Forwarded-For") || request.count("Via");
    return counted_address(address).is_loopback() && !page_elsewhere && !forwarded;
}

// Why somebody may not publish; "" if they may.
std::string FileServer::State::publishing_refused(const Request& request, const LiveTarget& target,
                                                  const net::ip::address& address) const {
    if (access.publishers) {
        auto token = std::string(bearer_token(request[http::field::authorization]));
        if (token.empty()) token = query_value(request.target(), "token").value_or("");
        if (token.empty()) return "publishing needs a token: Authorization: Bearer TOKEN";
        return may_publish(*access.publishers, target.name, token) ? ""
                                                                   : "this token is not that of the stream's publisher";
    }
    if (by_program_here(request, address)) return "";
    return "this hub knows no publishers: only programs on its own machine may publish";
}

// Nothing if this hub asks for no links, or the request has a good one to this path.
std::optional<Refusal> FileServer::State::link_refused(const std::string& path, const Request& request) const {
    if (!access.link_keys) return std::nullopt;
    const auto check = check_link(*access.link_keys, path, request.target(), std::chrono::system_clock::now());
    if (check == LinkCheck::good) return std::nullopt;
    const char* cause = check == LinkCheck::missing   ? "link_missing"
                        : check == LinkCheck::expired ? "link_expired"
                                                      : "link_forged";
    return Refusal{cause, link_sentence(check)};
}

// Counts and logs; of very many in a second only the first are logged, and how many there were.
void FileServer::State::tell_refused(const Refusal& refusal, const std::string& stream,
                                     const net::ip::address& address) {
    ++refused[refusal.cause];
    if (++refusals > most_told_refusals) return;
    tell({.name = "refused",
          .text = "refused: " + refusal.why,
          .stream = is_stream_name(stream) ? stream : "",
          .address = address.to_string()});
}

// One who has not sent a whole request within header_time, nor agreed on TLS.
void FileServer::State::tell_too_slow(const net::ip::address& address) {
    const auto seconds = std::to_string(options.header_time.count());
    tell_refused({"header_time", "the request did not come whole within " + seconds + " seconds"}, "", address);
}

net::awaitable<void> FileServer::State::publish(Line line, Request request, LiveTarget target,
                                                net::ip::address address) {
    auto header = common_header();
    std::optional<Refusal> refusal;
    if (!is_stream_name(target.name))
        refusal = {"name", stream_name_rule, http::status::bad_request};
    else if (!origin_allowed(request))
        refusal = {"origin", "pages of this site may not publish here"};
    else if (const auto why = publishing_refused(request, target, address); !why.empty())
        refusal = {"token", why, access.publishers ? http::status::unauthorized : http::status::forbidden};
    if (!refusal) {
        co_await publish_by_socket(std::move(line), request, target.name, *options.hub);
        co_return;
    }
    tell_refused(*refusal, target.name, address);
    if (refusal->status == http::status::unauthorized) {
        header.set(http::field::www_authenticate, "Bearer");
        net::steady_timer delay(context, options.refusal_delay);
        co_await delay.async_wait(awaited);
    }
    co_await refuse(std::move(line), std::move(header), *refusal);
}

net::awaitable<void> FileServer::State::watch(Line line, Request request, LiveTarget target, net::ip::address address) {
    auto header = common_header();
    let_others_read(request, header);
    const auto who = counted_address(address);
    const auto same = viewers_by_address.find(who);
    auto refusal = link_refused("watch/" + target.name, request);
    if (target.socket && !origin_allowed(request))
        refusal = {"origin", "pages of this site may not watch here"};
    else if (!refusal && same != viewers_by_address.end() && same->second >= options.viewers_per_address)
        refusal = {"address", "this address has as many viewers as it may", http::status::service_unavailable,
                   CloseCode::try_later};
    if (refusal) {
        tell_refused(*refusal, target.name, address);
        // A browser tells a page nothing of a WebSocket that was refused before it was opened.
        if (target.socket)
            co_await refuse_socket(std::move(line), request, refusal->code, refusal->why);
        else
            co_await refuse(std::move(line), std::move(header), *refusal);
        co_return;
    }
    const Counted counted(viewers_by_address, who);
    if (target.socket) {
        co_await watch_by_socket(std::move(line), request, target.name, *options.hub);
    } else {
        co_await watch_by_body(line, std::move(header), target.name, *options.hub);
        co_await line.close();
    }
}

// Answers with a sentence and ends the connection.
net::awaitable<void> FileServer::State::refuse(Line line, Header header, Refusal refusal) {
    Response response;
    response.header = std::move(header);
    response.header.keep_alive(false);
    say_why(response, refusal);
    co_await send(line, response, true);
    co_await line.close();
}

net::awaitable<void> FileServer::State::tick_hub() {
    net::steady_timer timer(context);
    for (;;) {
        timer.expires_after(std::chrono::milliseconds(100));
        co_await timer.async_wait(awaited);
        options.hub->tick(Hub::Clock::now());
        if (options.recorder)
            for (const auto& event : options.recorder->take_events()) tell(event);
    }
}

net::awaitable<void> FileServer::State::serve(Line line, net::ip::address address) {
    const Counted counted(by_address, counted_address(address));
    ++connections;
    line.next_layer().expires_after(options.header_time);
    if (const auto insecure = co_await line.handshake(net::ssl::stream_base::server)) {
        if (insecure == beast::error::timeout) tell_too_slow(address);
    } else {
        if (auto live = co_await answer_requests(line, address)) {
            auto& [request, target] = *live;
            if (target.publish)
                co_await publish(std::move(line), std::move(request), std::move(target), address);
            else
                co_await watch(std::move(line), std::move(request), std::move(target), address);
        } else {
            co_await line.close();
        }
    }
    --connections;
    if (draining && connections == 0) context.stop();
}

// Until the connection is of no further use, or a request is for a live stream: that one.
net::awaitable<std::optional<std::pair<Request, LiveTarget>>> FileServer::State::answer_requests(
    Line& line, const net::ip::address& address) {
    beast::flat_buffer buffer(header_limit);
    while (!draining) {
        http::request_parser<http::empty_body> parser;
        parser.header_limit(header_limit);
        line.next_layer().expires_after(options.header_time);
        idle.insert(&line);
        const auto [error, bytes] = co_await http::async_read_header(line, buffer, parser, awaited);
        idle.erase(&line);
        if (error == beast::error::timeout && parser.got_some()) tell_too_slow(address);
        if (error) break;
        // No request here has a body; one that does would be read as the next request.
        const bool body = !parser.is_done();
        auto& request = parser.get();
        if (auto live = body ? std::nullopt : live_target(request))
            co_return std::pair(std::move(request), std::move(*live));
        Response response;
        if (body)
            response.header.result(http::status::bad_request);
        else
            response = answer(request, address);
        const bool alive = request.keep_alive() && !body && !draining;
        response.header.keep_alive(alive);
        const bool sent = co_await send(line, response, request.method() != http::verb::head);
        if (!alive || !sent) break;
    }
    co_return std::nullopt;
}

net::awaitable<void> FileServer::State::accept() {
    for (;;) {
        auto [error, socket] = co_await acceptor.async_accept(awaited);
        if (error == net::error::operation_aborted || draining) co_return;
        if (error) {
            // Out of file descriptors, most likely: others have to end first.
            net::steady_timer pause(context, std::chrono::milliseconds(100));
            co_await pause.async_wait(awaited);
            continue;
        }
        beast::error_code unknown;
        const auto address = socket.remote_endpoint(unknown).address();
        const auto found = by_address.find(counted_address(address));
        const unsigned same = found == by_address.end() ? 0 : found->second;
        if (unknown || connections >= options.connections || same >= options.connections_per_address) {
            ++refused["connections"];
            continue;
        }
        beast::tcp_stream tcp(std::move(socket));
        Line line = access.tls ? Line(std::move(tcp), *access.tls) : Line(std::move(tcp));
        net::co_spawn(context, serve(std::move(line), address), net::detached);
    }
}

// How many watch, if others came or some left since this was last told.
void FileServer::State::tell_viewers() {
    std::size_t watching = 0;
    const auto streams = options.hub->streams(Hub::Clock::now());
    for (const auto& stream : streams) watching += stream.viewers;
    const auto joined = options.hub->counters().joined;
    const auto came = joined - told_joined;
    if (came == 0 && watching == told_watching) return;
    const auto left = told_watching + came - watching;
    told_joined = joined;
    told_watching = watching;
    const auto number = [](std::size_t value) { return static_cast<std::int64_t>(value); };
    tell({.name = "viewers",
          .text = std::to_string(watching) + " watch " + std::to_string(streams.size()) +
                  " streams; since the last time " + std::to_string(came) + " came and " + std::to_string(left) +
                  " left",
          .numbers = {{"viewers", number(watching)},
                      {"streams", number(streams.size())},
                      {"came", number(came)},
                      {"left", number(left)}}});
}

net::awaitable<void> FileServer::State::each_second() {
    constexpr int seconds_between_viewers = 60;
    int seconds_to_viewers = seconds_between_viewers;
    net::steady_timer timer(context);
    for (;;) {
        timer.expires_after(std::chrono::seconds(1));
        co_await timer.async_wait(awaited);
        if (refusals > most_told_refusals)
            tell({.name = "refused",
                  .text = std::to_string(refusals - most_told_refusals) + " more were refused in this second"});
        refusals = 0;
        if (options.hub && --seconds_to_viewers == 0) {
            seconds_to_viewers = seconds_between_viewers;
            tell_viewers();
        }
    }
}

net::awaitable<void> FileServer::State::reload_on_hangup() {
    net::signal_set hangup(context, SIGHUP);
    for (;;) {
        co_await hangup.async_wait(awaited);
        auto read = read_access(options);
        if (read) {
            access = std::move(*read);
            tell({.name = "reloaded", .text = "certificate, publishers and keys were read again"});
        } else {
            tell({.name = "reload_failed",
                  .text = read.error().message + "; certificate, publishers and keys stay as they were",
                  .warning = true});
        }
    }
}

net::awaitable<void> FileServer::State::drain_on_signal() {
    net::signal_set signals(context, SIGINT, SIGTERM);
    co_await signals.async_wait(awaited);
    draining = true;
    beast::error_code ignored;
    acceptor.close(ignored);
    for (auto* line : idle) line->next_layer().cancel();
    if (options.hub) options.hub->close_all(CloseCode::shut_down, "the hub shuts down");
    if (connections == 0) context.stop();
    net::steady_timer timer(context, options.drain_time);
    timer.async_wait([this](const beast::error_code& cancelled) {
        if (!cancelled) context.stop();
    });
    co_await signals.async_wait(awaited);
    context.stop();
}

FileServer::FileServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
FileServer::FileServer(FileServer&&) noexcept = default;
FileServer& FileServer::operator=(FileServer&&) noexcept = default;
FileServer::~FileServer() = default;

Result<FileServer> FileServer::open(const FileServerOptions& options) {
    auto state = std::make_unique<State>(options);
    auto access = read_access(options);
    if (!access) return tl::unexpected(access.error());
    state->access = std::move(*access);
    if (options.files.empty() && !options.folder.empty()) {
        auto folder = ServedFolder::open(options.folder);
        if (!folder) return tl::unexpected(folder.error());
        state->folder.emplace(std::move(*folder));
    }
    for (const auto& file : player_files())
        state->player.emplace(file.name, make_text(file.name, std::string(file.content)));
    beast::error_code error;
    const auto address = net::ip::make_address(options.address, error);
    if (error) return fail(ErrorKind::bad_input, options.address + " is not an IP address");
    const tcp::endpoint endpoint(address, options.port);
    auto& acceptor = state->acceptor;
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    // Connections inherit it.
    if (const auto& name = options.congestion_control; !error && !name.empty())
        ::setsockopt(acceptor.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(),
                     static_cast<socklen_t>(name.size()));
    if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
    if (error)
        return fail(ErrorKind::bad_input, "cannot listen on " + options.address + " port " +
                                              std::to_string(options.port) + ": " + error.message());
    if (options.hub && !options.nats.servers.empty()) {
        auto nats = NatsLink::open(options.nats, *options.hub, state->context);
        if (!nats) return tl::unexpected(nats.error());
        state->nats.emplace(std::move(*nats));
    }
    state->port = acceptor.local_endpoint().port();
    if (options.hub && options.recorder) record(*options.hub, *options.recorder);
    return FileServer(std::move(state));
}

std::uint16_t FileServer::port() const { return state_->port; }

std::string FileServer::congestion_control() const {
    std::array<char, 16> name{};  // TCP_CA_NAME_MAX of the kernel
    auto size = static_cast<socklen_t>(name.size());
    ::getsockopt(state_->acceptor.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(), &size);
    return {name.data(), ::strnlen(name.data(), name.size())};
}

void FileServer::run() {
    auto& state = *state_;
    net::co_spawn(state.context, state.accept(), net::detached);
    net::co_spawn(state.context, state.each_second(), net::detached);
    if (state.options.hub) net::co_spawn(state.context, state.tick_hub(), net::detached);
    net::co_spawn(state.context, state.drain_on_signal(), net::detached);
    const auto& options = state.options;
    if (!options.certificate.empty() || !options.publishers.empty() || !options.link_keys.empty())
        net::co_spawn(state.context, state.reload_on_hangup(), net::detached);
    state.context.run();
}

void FileServer::stop() { state_->context.stop(); }

bool has_player() { return !player_files().empty(); }

}  // namespace htvm::live
