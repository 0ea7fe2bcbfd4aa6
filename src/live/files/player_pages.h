// The player's page and scripts, as they are sent: compressed once, and with tags by which a browser asks whether it
// has them still.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "live/files/http_request.h"
#include "live/files/response.h"

namespace htvm::live {

struct PlayerPage {
    std::string_view type;  // its media type
    std::string_view content;
    std::string compressed;  // by gzip
    std::string tag;         // an entity tag, quotes included
};

// By name; the page itself is "index.html". None in a build without the player.
using PlayerPages = std::map<std::string, PlayerPage, std::less<>>;
PlayerPages player_pages();

// The page must outlive the response.
Response page_response(const PlayerPage& page, const Request& request, ResponseHeader header);

}  // namespace htvm::live
