// What is answered of the player's pages and of files, whatever server it is and whoever may ask.
#pragma once

#include <string>
#include <vector>

#include "live/files/http_request.h"
#include "live/files/player_pages.h"
#include "live/files/response.h"
#include "live/files/served_files.h"

namespace htvm::live {

// What every response has. resource_policy: "same-origin", or "cross-origin" where pages of other sites may read some.
ResponseHeader common_header(const char* resource_policy);

Response wrong_method_response(ResponseHeader header);
Response bad_path_response(ResponseHeader header);
// The player's page or file of that name, or 404. The pages must outlive the response.
Response page_response(const PlayerPages& pages, const std::string& name, const Request& request,
                       ResponseHeader header);
// The file at these segments below /files/, the part of it that is asked for, that it has not changed, or 404.
Response file_response(const ServedFiles& files, const std::vector<std::string>& segments, const Request& request,
                       ResponseHeader header);
// The list of the streams, as JSON. It walks the folder.
std::string file_list(const ServedFiles& files);

}  // namespace htvm::live
