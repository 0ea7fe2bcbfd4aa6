#include "live/server/segment_handler.h"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <memory>
#include <optional>
#include <utility>

#include "live/server/handlers.h"
#include "live/server/live_segments.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr const char* playlist_name = "stream.m3u8";
constexpr const char* ladder_name = "master.m3u8";

struct Asked {
    std::string link{};  // as a target with a query
    std::string stream, file;
};

std::optional<Asked> asked_by(const std::vector<std::string>& path) {
    if (path.size() == 2) return Asked{.stream = path[0], .file = path[1]};
    if (path.size() != 3) return std::nullopt;
    auto link = link_target(path[0]);
    if (link.empty()) return std::nullopt;
    return Asked{.link = std::move(link), .stream = path[1], .file = path[2]};
}

// Nothing where the numbers are none.
struct Wanted {
    bool good = true;
    std::optional<LiveSegments::Position> position{};
};
Wanted wanted_by(const Request& request) {
    const auto segment = query_value(request.target(), "_HLS_msn"), part = query_value(request.target(), "_HLS_part");
    if (!segment) return {.good = !part.has_value()};
    const auto number = whole_number(*segment), part_number = part ? whole_number(*part) : std::nullopt;
    if (!number || (part && !part_number)) return {.good = false};
    return {.position = LiveSegments::Position{*number, part_number}};
}

// What is asked for, once it is there.
net::awaitable<LiveSegments::Found> find(LiveSegments& segments, const Asked& asked,
                                         const std::optional<LiveSegments::Position>& position) {
    const auto timer = std::make_shared<net::steady_timer>(co_await net::this_coro::executor);
    const auto look = [&](bool patient = true) {
        // It may come late, when nobody waits any more, and on another thread.
        const auto wake = [timer] { net::post(timer->get_executor(), [timer] { timer->cancel(); }); };
        if (asked.file == ladder_name) return segments.ladder(asked.stream, patient, wake);
        return asked.file == playlist_name ? segments.playlist(asked.stream, position, wake)
                                           : segments.file(asked.stream, asked.file, wake);
    };
    auto found = look();
    const auto end =
        std::chrono::steady_clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1000 * found.patience));
    while (found.state == LiveSegments::Found::State::waits && std::chrono::steady_clock::now() < end) {
        timer->expires_at(end);
        co_await timer->async_wait(awaited);
        // Whoever has waited is in nobody's way when it asks again.
        found.waiting.reset();
        found = look();
    }
    // One of a ladder's rungs may never come.
    co_return found.state == LiveSegments::Found::State::waits ? look(false) : found;
}

// For those for whom nothing is there: caches ask again soon.
Response soon_again(http::status status, ResponseHeader header) {
    header.set(http::field::cache_control, "public, max-age=1");
    return empty_response(status, std::move(header));
}

Response playlist_response(const LiveSegments::Found& found, bool waited, const Request& request,
                           ResponseHeader header) {
    header.set(http::field::etag, found.tag);
    // One that was waited for has what was asked for, however late it is taken.
    header.set(http::field::cache_control, waited ? "public, max-age=6" : "public, max-age=1");
    if (names_tag(request[http::field::if_none_match], found.tag))
        return empty_response(http::status::not_modified, std::move(header));
    header.set(http::field::content_type, media_type(playlist_name));
    return {.header = std::move(header), .content = found.content, .keeps = found.bytes};
}

Response file_response(const LiveSegments::Found& found, const std::string& name, const Request& request,
                       ResponseHeader header) {
    const auto tag = '"' + name + '"';
    header.set(http::field::etag, tag);
    header.set(http::field::cache_control, "public, max-age=31536000, immutable");
    header.set(http::field::accept_ranges, "bytes");
    if (names_tag(request[http::field::if_none_match], tag))
        return empty_response(http::status::not_modified, std::move(header));
    const auto condition = request[http::field::if_range];
    const auto size = found.content.size();
    const auto part = requested_part(condition.empty() || condition == tag ? request[http::field::range] : "", size);
    if (part.kind == FilePart::Kind::beyond) {
        header.set(http::field::content_range, "bytes */" + std::to_string(size));
        return empty_response(http::status::range_not_satisfiable, std::move(header));
    }
    auto content = found.content;
    if (part.kind == FilePart::Kind::part) {
        header.result(http::status::partial_content);
        header.set(http::field::content_range, "bytes " + std::to_string(part.first) + '-' +
                                                   std::to_string(part.first + part.count - 1) + '/' +
                                                   std::to_string(size));
        content = content.substr(part.first, part.count);
    }
    header.set(http::field::content_type, media_type(name));
    return {.header = std::move(header), .content = content, .keeps = found.bytes};
}

Response refused_response(LiveSegments::Found::State state, ResponseHeader header) {
    using State = LiveSegments::Found::State;
    if (state == State::too_far) return empty_response(http::status::bad_request, std::move(header));
    if (state == State::nothing) return soon_again(http::status::not_found, std::move(header));
    header.set(http::field::retry_after, "1");
    header.set(http::field::cache_control, "no-store");
    return empty_response(http::status::service_unavailable, std::move(header));
}

net::awaitable<Response> answer_asked(const Site& site, const Asked& asked, const Request& request,
                                      ResponseHeader header) {
    const bool list = asked.file == playlist_name || asked.file == ladder_name;
    const auto wanted = asked.file == playlist_name ? wanted_by(request) : Wanted{};
    if (!wanted.good) co_return empty_response(http::status::bad_request, std::move(header));
    auto found = co_await find(*site.segments, asked, wanted.position);
    if (found.state != LiveSegments::Found::State::there) co_return refused_response(found.state, std::move(header));
    co_return list ? playlist_response(found, wanted.position.has_value(), request, std::move(header))
                   : file_response(found, asked.file, request, std::move(header));
}

}  // namespace

net::awaitable<Response> answer_segments(const Site& site, const std::vector<std::string>& path, const Request& request,
                                         const Client& client, ResponseHeader header) {
    site.admission.let_others_read(request, header);
    if (header.count(http::field::access_control_allow_origin))
        header.set(http::field::access_control_expose_headers, "Content-Range, ETag, Date, Age");
    const auto asked = asked_by(path);
    if (!asked || !site.segments) co_return empty_response(http::status::not_found, std::move(header));
    auto refusal = site.admission.refuse_segments(request, asked->stream, asked->link);
    if (refusal && refusal->may_be_asked)
        refusal = co_await ask_authority(site, "watch", asked->stream, request, client, std::move(*refusal));
    if (refusal) {
        site.refusals.count(refusal->cause);
        co_return refusing_response(*refusal, std::move(header));
    }
    if (asked->file == "check") {
        header.set(http::field::cache_control, "public, max-age=30");
        co_return empty_response(http::status::ok, std::move(header));
    }
    auto response = co_await answer_asked(site, *asked, request, std::move(header));
    // What somebody may have by a token a cache must not hand to others.
    if (auto kept = std::string(response.header[http::field::cache_control]);
        site.admission.guards_watching() && kept.starts_with("public"))
        response.header.set(http::field::cache_control, "private" + kept.substr(6));
    const auto* kind = asked->file == playlist_name ? "playlist_" : asked->file == ladder_name ? "master_" : "file_";
    ++site.traffic.segment_requests[kind + std::to_string(response.header.result_int())];
    if (request.method() != http::verb::head) site.traffic.segment_bytes += response.content.size();
    co_return response;
}

}  // namespace htvm::live
