#include "live/server/handlers.h"

#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "live/client/control.h"
#include "live/files/file_answers.h"
#include "live/files/response_sending.h"
#include "live/hub/stream_name.h"
#include "live/server/live_connection.h"
#include "live/server/metrics.h"
#include "live/server/segment_handler.h"

namespace htvm::live {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr const char *json_type = "application/json", *plain_text = "text/plain; charset=utf-8";

ResponseHeader common_header(const Site& site) {
    return live::common_header(site.admission.has_other_sites() ? "cross-origin" : "same-origin");
}

// Names of streams may be any bytes.
std::string json_text(const nlohmann::json& json) {
    return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string stream_list(const Hub& hub) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& stream : hub.streams(Hub::Clock::now())) {
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
    return json_text(list);
}

std::string metrics_of(const Site& site) {
    return metrics_text({.hub = site.hub,
                         .recorder = site.recorder,
                         .segments = site.segments,
                         .nats = site.nats ? std::optional(site.nats->counters()) : std::nullopt,
                         .authority = site.authority ? &site.authority->counters() : nullptr,
                         .refused = site.refusals.by_cause(),
                         .traffic = &site.traffic,
                         .ready = !site.ending,
                         .connections = site.admission.connections(),
                         .started = site.started},
                        Hub::Clock::now());
}

// segments: below /files/.
Response answer_file(const Site& site, const std::vector<std::string>& segments, const Request& request,
                     ResponseHeader header) {
    std::string path = "files";
    for (const auto& segment : segments) path += '/' + segment;
    site.admission.let_others_read(request, header);
    if (header.count(http::field::access_control_allow_origin))
        header.set(http::field::access_control_expose_headers, "Content-Range, ETag");
    if (const auto refusal = site.admission.refuse_path(path, request)) {
        site.refusals.count(refusal->cause);
        return refusing_response(*refusal, std::move(header));
    }
    return file_response(site.files, segments, request, std::move(header));
}

Response answer_readiness(const Site& site, ResponseHeader header) {
    if (site.ending) header.result(http::status::service_unavailable);
    return text_response(site.ending ? "ending\n" : "ready\n", plain_text, std::move(header));
}

// Answers with a sentence and ends the connection.
net::awaitable<void> refuse(const Site& site, Line line, ResponseHeader header, Refusal refusal) {
    header.keep_alive(false);
    auto response = refusing_response(refusal, std::move(header));
    co_await send(line, response, true, site.stall_time);
    co_await line.close();
}

net::awaitable<void> publish(const Site& site, Line line, Request request, std::string stream, Client client) {
    auto refusal = site.admission.refuse_publishing(request, stream, client);
    if (refusal && refusal->may_be_asked)
        refusal = co_await ask_authority(site, "publish", stream, request, client, std::move(*refusal));
    if (!refusal) {
        co_await publish_by_socket(std::move(line), std::move(request), std::move(stream), *site.hub);
        co_return;
    }
    site.refusals.tell(*refusal, stream, client.address);
    auto header = common_header(site);
    if (refusal->status == http::status::unauthorized) header.set(http::field::www_authenticate, "Bearer");
    if (refusal->delay.count() > 0) {
        net::steady_timer delay(line.get_executor(), refusal->delay);
        co_await delay.async_wait(awaited);
    }
    co_await refuse(site, std::move(line), std::move(header), *refusal);
}

net::awaitable<void> watch(const Site& site, Line line, Request request, Route route, Client client) {
    auto header = common_header(site);
    site.admission.let_others_read(request, header);
    auto refused = site.admission.refuse_watching(request, route.name, route.socket);
    if (refused && refused->may_be_asked)
        refused = co_await ask_authority(site, "watch", route.name, request, client, std::move(*refused));
    using Place = tl::expected<AddressCounts::Place, Refusal>;
    const auto place = refused ? Place(tl::unexpect, *refused) : site.admission.place_for_viewer(client);
    if (!place) {
        const auto refusal = place.error();
        site.refusals.tell(refusal, route.name, client.address);
        // A browser tells a page nothing of a WebSocket that was refused before it was opened.
        if (route.socket)
            co_await refuse_socket(std::move(line), std::move(request), refusal.code, refusal.why);
        else
            co_await refuse(site, std::move(line), std::move(header), refusal);
        co_return;
    }
    if (route.socket) {
        co_await watch_by_socket(std::move(line), std::move(request), std::move(route.name), *site.hub);
    } else {
        co_await watch_by_body(line, std::move(header), std::move(route.name), *site.hub);
        co_await line.close();
    }
}

Response shared_response(SharedText::Text text, const char* type, ResponseHeader header) {
    if (!text) return empty_response(http::status::service_unavailable, std::move(header));
    return text_response(std::move(text), type, std::move(header));
}

// On a thread of its own, which leaves the processor to the server's.
net::awaitable<std::string> walk(const ServedFiles& files) {
    constexpr int yielding = 10;
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), yielding);
    co_return file_list(files);
}

// A thousandth of a second for every one that is asked for, at most: they are made 50 times a second.
constexpr std::chrono::milliseconds between_texts{20}, between_walks{500};

}  // namespace

net::awaitable<std::optional<Refusal>> ask_authority(const Site& site, const char* action, const std::string& stream,
                                                     const Request& request, const Client& client, Refusal otherwise) {
    Question question{action, std::string(ladder_of(stream)), client.address.to_string(), shown_token(request)};
    const auto answer = co_await site.authority->ask(std::move(question));
    if (answer == Answer::yes) co_return std::nullopt;
    otherwise.cause = answer == Answer::no ? "authority" : "authority_silent";
    otherwise.why =
        "the web service that this hub asks does not allow it: a token or a link is missing, or no longer good";
    if (answer == Answer::no) co_return otherwise;
    otherwise.why = "the web service that this hub asks has not answered";
    otherwise.status = http::status::service_unavailable;
    otherwise.code = CloseCode::try_later;
    co_return otherwise;
}

SharedTexts::SharedTexts(const Site& site, const net::any_io_executor& executor)
    : streams(executor, between_texts,
              [&site]() -> net::awaitable<std::string> { co_return site.hub ? stream_list(*site.hub) : "null"; }),
      metrics(executor, between_texts, [&site]() -> net::awaitable<std::string> { co_return metrics_of(site); }),
      files(executor, between_walks, [this, &site]() -> net::awaitable<std::string> {
          return net::co_spawn(walker, walk(site.files), net::use_awaitable);
      }) {}

net::awaitable<Response> answer(const Site& site, const Route& route, const Request& request, const Client& client) {
    SharedText::Text text;
    auto header = common_header(site);
    if (!site.admission.host_allowed(request))
        co_return empty_response(http::status::misdirected_request, std::move(header));
    switch (route.handler) {
        case Handler::wrong_method:
            co_return wrong_method_response(std::move(header));
        case Handler::bad_path:
            co_return bad_path_response(std::move(header));
        case Handler::page:
            co_return page_response(site.pages, "index.html", request, std::move(header));
        case Handler::player_file:
            co_return page_response(site.pages, route.name, request, std::move(header));
        case Handler::file:
            co_return answer_file(site, route.path, request, std::move(header));
        case Handler::file_list:
            if (const auto refusal = site.admission.refuse_lists())
                co_return refusing_response(*refusal, std::move(header));
            text = co_await site.texts->files.fresh();
            co_return shared_response(std::move(text), json_type, std::move(header));
        case Handler::stream_list:
            if (const auto refusal = site.admission.refuse_lists())
                co_return refusing_response(*refusal, std::move(header));
            text = co_await site.texts->streams.fresh();
            co_return shared_response(std::move(text), json_type, std::move(header));
        case Handler::segments:
            co_return co_await answer_segments(site, route.path, request, client, std::move(header));
        case Handler::health:
            co_return text_response("ok\n", plain_text, std::move(header));
        case Handler::readiness:
            co_return answer_readiness(site, std::move(header));
        case Handler::metrics:
            if (!site.admission.may_read_metrics(request, client))
                co_return empty_response(http::status::forbidden, std::move(header));
            text = co_await site.texts->metrics.fresh();
            co_return shared_response(std::move(text), metrics_type, std::move(header));
        case Handler::publish:
        case Handler::watch:  // carry() does
        case Handler::nothing:
            break;
    }
    co_return empty_response(http::status::not_found, std::move(header));
}

net::awaitable<void> carry(const Site& site, Line line, Request request, Route route, Client client, bool has_place) {
    const Refusal full{"address", "this address has as many connections as it may", http::status::service_unavailable,
                       CloseCode::try_later};
    if (!has_place) site.refusals.tell(full, route.name, client.address);
    if (!has_place && route.socket) {
        co_await refuse_socket(std::move(line), std::move(request), full.code, full.why);
    } else if (!has_place) {
        co_await refuse(site, std::move(line), common_header(site), full);
    } else if (site.ending && route.socket) {
        co_await refuse_socket(std::move(line), std::move(request), CloseCode::shut_down, "the hub shuts down");
    } else if (route.handler == Handler::publish) {
        co_await publish(site, std::move(line), std::move(request), std::move(route.name), client);
    } else {
        co_await watch(site, std::move(line), std::move(request), std::move(route), client);
    }
}

}  // namespace htvm::live
