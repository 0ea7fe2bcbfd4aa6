#include "live/files/routing.h"

#include <boost/beast/websocket/rfc6455.hpp>
#include <utility>

namespace htvm::live {

namespace beast = boost::beast;
namespace http = beast::http;

const char* name_of(Handler handler) {
    switch (handler) {
        case Handler::page:
            return "page";
        case Handler::player_file:
            return "player_file";
        case Handler::file_list:
            return "file_list";
        case Handler::file:
            return "file";
        case Handler::stream_list:
            return "stream_list";
        case Handler::segments:
            return "segments";
        case Handler::health:
            return "health";
        case Handler::readiness:
            return "readiness";
        case Handler::metrics:
            return "metrics";
        case Handler::publish:
            return "publish";
        case Handler::watch:
            return "watch";
        case Handler::wrong_method:
        case Handler::bad_path:
        case Handler::nothing:
            break;
    }
    return "nothing";
}

Route route_of(const Request& request, bool has_hub) {
    auto path = path_segments(request.target());
    const bool get = request.method() == http::verb::get;
    if (path && path->size() == 2 && has_hub) {
        const bool socket = beast::websocket::is_upgrade(request);
        if ((*path)[0] == "publish" && socket)
            return {.handler = Handler::publish, .name = std::move((*path)[1]), .socket = true};
        if ((*path)[0] == "watch" && get)
            return {.handler = Handler::watch, .name = std::move((*path)[1]), .socket = socket};
    }
    if (!get && request.method() != http::verb::head) return {.handler = Handler::wrong_method};
    if (!path) return {.handler = Handler::bad_path};
    if (path->empty()) return {.handler = Handler::page};

    const auto first = (*path)[0];
    if (path->size() == 1) {
        if (first == "healthz") return {.handler = Handler::health};
        if (first == "readyz") return {.handler = Handler::readiness};
        if (first == "metrics") return {.handler = Handler::metrics};
        return {};
    }
    if (first == "files") {
        path->erase(path->begin());
        return {.handler = Handler::file, .path = std::move(*path)};
    }
    if (first == "hls" && has_hub) {
        path->erase(path->begin());
        return {.handler = Handler::segments, .path = std::move(*path)};
    }
    if (path->size() > 2) return {};
    auto& name = (*path)[1];
    if (first == "api" && name == "files") return {.handler = Handler::file_list};
    if (first == "api" && name == "streams") return {.handler = Handler::stream_list};
    if (first == "player") return {.handler = Handler::player_file, .name = std::move(name)};
    // The page finds the live stream of that name by itself.
    if (first == "play" && has_hub) return {.handler = Handler::page};
    return {};
}

}  // namespace htvm::live
