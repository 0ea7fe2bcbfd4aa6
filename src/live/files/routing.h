// Which handler answers which request. Nothing here depends on who asks, or on what there is to be answered.
//
//   /                the player's page; it lists the streams, or plays one: /?file=NAME
//   /player/NAME     the player's scripts, kept in the program
//   /api/files       the streams as JSON: [{"path": ..., "bytes": ..., "poster": ...}, ...]; the poster of NAME.htvm is
//                    NAME.png or NAME.jpg beside it, where there is one
//   /files/PATH      the streams themselves, by ranges too
//
// With a hub, live streams too (WebSockets; /watch/NAME is an endless body where no WebSocket is asked for):
//   /publish/NAME    packets from a publisher: one with the stream's token, or, where no publishers are known, a
//                    program on this machine
//   /watch/NAME      packets for viewers
//   /api/streams     the live streams as JSON; null where there is no hub
//   /play/NAME       the page, which plays the live stream of that name
//   /hls/NAME/...    with segments: the stream's playlist, stream.m3u8, and what it names; /hls/LINK/NAME/... where
//                    links are asked for (live/server/segment_handler.h)
//
// For those who run it:
//   /healthz         "ok": the server's thread runs
//   /readyz          "ready", or 503 once the server is ending and new connections should go elsewhere
//   /metrics         what it counts (live/server/metrics.h)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "live/files/http_request.h"

namespace htvm::live {

enum class Handler : std::uint8_t {
    wrong_method,  // neither GET nor HEAD
    bad_path,
    nothing,  // there is nothing at this path
    page,
    player_file,
    file_list,
    file,
    stream_list,
    segments,
    health,
    readiness,
    metrics,
    // These carry a live stream over the connection, which is of no use for anything else from then on:
    publish,
    watch,
};

// A word, to count by.
const char* name_of(Handler handler);

struct Route {
    Handler handler = Handler::nothing;
    std::string name{};               // of the live stream or of the player's file
    std::vector<std::string> path{};  // of a file: its segments below /files/; of a live stream's segments: below /hls/
    bool socket = false;              // watch: by a WebSocket, as publish always is

    bool is_live() const { return handler == Handler::publish || handler == Handler::watch; }
};

// has_hub: whether there are live streams.
Route route_of(const Request& request, bool has_hub);

}  // namespace htvm::live
