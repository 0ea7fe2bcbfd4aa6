// What is counted of connections and requests, for /metrics.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "live/hub/histogram.h"

namespace htvm::live {

struct Traffic {
    std::map<std::string, std::uint64_t> closed;   // connections that carried no live stream, by why they ended
    std::map<std::string, Histogram> answer_time;  // from a request's header to its response, by handler
    std::map<std::string, std::uint64_t> segment_requests;  // of live streams: for playlists and files, by answer
    std::uint64_t segment_bytes = 0;                        // of the answers
    Histogram late;                                         // by how much what is due ten times a second came late
};

}  // namespace htvm::live
