// Answers requests for the segments of live streams, below /hls/:
//
//   NAME/stream.m3u8         the playlist; ?_HLS_msn=N&_HLS_part=P waits until it has that (HLS, second edition)
//   NAME/master.m3u8         the list of the playlists of a ladder's rungs, NAME~1 to NAME~8, and of NAME itself
//   NAME/map-HASH.mp4        what is needed before a segment
//   NAME/NUMBER-HASH.m4s     a segment, and, with parts, NUMBER-TAG.PART.m4s, which waits if it is the one that is next
//   LINK/NAME/...            the same where links are asked for: LINK is link_segment() (credentials.h) of hls/NAME
//   LINK/NAME/check          nothing but whether the link is good: 200, or 403 and a sentence. Caches ask this
//
// Where watching takes a token, or an authority is asked, so do segments; caches must not keep them then.
//
// Names in playlists are relative, so whoever has the playlist by a link has all by it; and what a cache holds is the
// same for all links.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <string>
#include <vector>

#include "live/files/http_request.h"
#include "live/files/response.h"

namespace htvm::live {

struct Client;
struct Site;

// path: the segments below /hls/.
boost::asio::awaitable<Response> answer_segments(const Site& site, const std::vector<std::string>& path,
                                                 const Request& request, const Client& client, ResponseHeader header);

}  // namespace htvm::live
