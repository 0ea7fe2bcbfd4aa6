#include "live/file_server.h"

#include <netinet/tcp.h>

#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
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

#include "core/crc32.h"
#include "live/http_request.h"
#include "live/live_connection.h"
#include "live/player_files.h"
#include "live/served_folder.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = net::ip::tcp;

constexpr std::size_t header_limit = 8192, piece_bytes = 65536;
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

}  // namespace

struct FileServer::State {
    FileServerOptions options;
    std::optional<ServedFolder> folder;  // unless there are files with names
    net::io_context context{1};
    tcp::acceptor acceptor{context};
    std::optional<NatsLink> nats;  // if the hub is joined with others
    std::map<std::string, Text, std::less<>> player;
    std::map<net::ip::address, unsigned> by_address;
    unsigned connections = 0;

    explicit State(const FileServerOptions& given) : options(given) {}

    Header common_header() const;
    Response answer(const Request& request);
    Response answer_file(const Request& request, std::vector<std::string> segments, Header header);
    Response answer_text(const Request& request, const Text& text, Header header);
    Response answer_json(std::string json, Header header) const;
    std::string listing() const;
    std::string live_listing() const;
    Result<ServedFile> served_file(const std::vector<std::string>& segments) const;
    bool host_is_loopback(std::string_view host) const;

    net::awaitable<void> accept();
    net::awaitable<void> serve(Line line, net::ip::address address);
    std::optional<LiveTarget> live_target(const Request& request) const;
    std::string publishing_refused(const Request& request, const net::ip::address& address) const;
    net::awaitable<void> serve_live(Line line, Request request, LiveTarget target, net::ip::address address);
    net::awaitable<void> refuse(Line line, Header header, http::status status, std::string why);
    net::awaitable<void> tick_hub();
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
    const auto port = ':' + std::to_string(acceptor.local_endpoint().port());
    if (host.ends_with(port)) host.remove_suffix(port.size());
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
    segments.erase(segments.begin());
    if (options.other_sites) {
        out.header.set(http::field::access_control_allow_origin, "*");
        out.header.set(http::field::access_control_expose_headers, "Content-Range, ETag");
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

Response FileServer::State::answer_json(std::string json, Header header) const {
    Response out;
    out.header = std::move(header);
    out.own = std::move(json);
    out.header.set(http::field::content_type, "application/json");
    out.header.set(http::field::cache_control, "no-store");
    return out;
}

// What every response has.
Header FileServer::State::common_header() const {
    Header header{http::status::ok, 11};
    header.set("X-Content-Type-Options", "nosniff");
    header.set("Referrer-Policy", "no-referrer");
    header.set("Cross-Origin-Resource-Policy", options.other_sites ? "cross-origin" : "same-origin");
    return header;
}

Response FileServer::State::answer(const Request& request) {
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
    if (path.size() == 2 && path[0] == "api" && path[1] == "files") return answer_json(listing(), header);
    if (path.size() == 2 && path[0] == "api" && path[1] == "streams")
        return answer_json(options.hub ? live_listing() : "null", header);
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

// Why somebody may not publish; "" if they may. A web page in a browser of this machine is somebody else, and so is who
// comes through a web server on this machine.
std::string FileServer::State::publishing_refused(const Request& request, const net::ip::address& address) const {
    const auto origin = request[http::field::origin];
    const bool page_elsewhere = !origin.empty() && !host_is_loopback(host_of_origin(origin));
    const bool forwarded = request.count("Forwarded") || request.count("X-Forwarded-For") || request.count("Via");
    if (address.is_loopback() && !page_elsewhere && !forwarded) return "";
    return "this hub knows no publishers: only programs on its own machine may publish";
}

net::awaitable<void> FileServer::State::serve_live(Line line, Request request, LiveTarget target,
                                                   net::ip::address address) {
    auto header = common_header();
    if (options.other_sites) header.set(http::field::access_control_allow_origin, "*");
    if (target.publish) {
        if (const auto why = publishing_refused(request, address); !why.empty())
            co_await refuse(std::move(line), std::move(header), http::status::forbidden, why);
        else
            co_await publish_by_socket(std::move(line), request, target.name, *options.hub);
    } else if (target.socket) {
        co_await watch_by_socket(std::move(line), request, target.name, *options.hub);
    } else {
        co_await watch_by_body(line, std::move(header), target.name, *options.hub);
        co_await line.close();
    }
}

// Answers with a sentence and ends the connection.
net::awaitable<void> FileServer::State::refuse(Line line, Header header, http::status status, std::string why) {
    Response response;
    response.header = std::move(header);
    response.header.result(status);
    response.header.keep_alive(false);
    response.header.set(http::field::content_type, "text/plain; charset=utf-8");
    response.own = std::move(why) + '\n';
    co_await send(line, response, true);
    co_await line.close();
}

net::awaitable<void> FileServer::State::tick_hub() {
    net::steady_timer timer(context);
    for (;;) {
        timer.expires_after(std::chrono::milliseconds(100));
        co_await timer.async_wait(awaited);
        options.hub->tick(Hub::Clock::now());
    }
}

net::awaitable<void> FileServer::State::serve(Line line, net::ip::address address) {
    beast::flat_buffer buffer(header_limit);
    bool open = true;
    while (open) {
        http::request_parser<http::empty_body> parser;
        parser.header_limit(header_limit);
        line.next_layer().expires_after(options.header_time);
        const auto [error, bytes] = co_await http::async_read_header(line, buffer, parser, awaited);
        if (error) break;
        // No request here has a body; one that does would be read as the next request.
        const bool body = !parser.is_done();
        const auto& request = parser.get();
        if (auto live = body ? std::nullopt : live_target(request)) {
            open = false;
            co_await serve_live(std::move(line), request, std::move(*live), address);
            break;
        }
        Response response;
        if (body)
            response.header.result(http::status::bad_request);
        else
            response = answer(request);
        const bool alive = request.keep_alive() && !body;
        response.header.keep_alive(alive);
        const bool sent = co_await send(line, response, request.method() != http::verb::head);
        if (!alive || !sent) break;
    }
    if (open) co_await line.close();
    --connections;
    if (--by_address[address] == 0) by_address.erase(address);
}

net::awaitable<void> FileServer::State::accept() {
    for (;;) {
        auto [error, socket] = co_await acceptor.async_accept(awaited);
        if (error == net::error::operation_aborted) co_return;
        if (error) {
            // Out of file descriptors, most likely: others have to end first.
            net::steady_timer pause(context, std::chrono::milliseconds(100));
            co_await pause.async_wait(awaited);
            continue;
        }
        beast::error_code unknown;
        const auto address = socket.remote_endpoint(unknown).address();
        const auto found = by_address.find(address);
        const unsigned same = found == by_address.end() ? 0 : found->second;
        if (unknown || connections >= options.connections || same >= options.connections_per_address) continue;
        ++connections;
        by_address[address] = same + 1;
        net::co_spawn(context, serve(Line(beast::tcp_stream(std::move(socket))), address), net::detached);
    }
}

FileServer::FileServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
FileServer::FileServer(FileServer&&) noexcept = default;
FileServer& FileServer::operator=(FileServer&&) noexcept = default;
FileServer::~FileServer() = default;

Result<FileServer> FileServer::open(const FileServerOptions& options) {
    auto state = std::make_unique<State>(options);
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
    return FileServer(std::move(state));
}

std::uint16_t FileServer::port() const { return state_->acceptor.local_endpoint().port(); }

std::string FileServer::congestion_control() const {
    std::array<char, 16> name{};  // TCP_CA_NAME_MAX of the kernel
    auto size = static_cast<socklen_t>(name.size());
    ::getsockopt(state_->acceptor.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(), &size);
    return {name.data(), ::strnlen(name.data(), name.size())};
}

void FileServer::run() {
    net::signal_set signals(state_->context, SIGINT, SIGTERM);
    signals.async_wait([this](const beast::error_code&, int) { state_->context.stop(); });
    net::co_spawn(state_->context, state_->accept(), net::detached);
    if (state_->options.hub) net::co_spawn(state_->context, state_->tick_hub(), net::detached);
    state_->context.run();
}

void FileServer::stop() { state_->context.stop(); }

bool has_player() { return !player_files().empty(); }

}  // namespace htvm::live
