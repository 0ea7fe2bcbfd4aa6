#include "live/files/file_answers.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace htvm::live {

namespace http = boost::beast::http;

ResponseHeader common_header(const char* resource_policy) {
    ResponseHeader header{http::status::ok, 11};
    header.set("X-Content-Type-Options", "nosniff");
    header.set("Referrer-Policy", "no-referrer");
    header.set("Cross-Origin-Resource-Policy", resource_policy);
    return header;
}

Response wrong_method_response(ResponseHeader header) {
    header.set(http::field::allow, "GET, HEAD");
    return empty_response(http::status::method_not_allowed, std::move(header));
}

Response bad_path_response(ResponseHeader header) {
    return sentence_response(http::status::bad_request, "a path here has no part that is empty or begins with '.'",
                             std::move(header));
}

Response page_response(const PlayerPages& pages, const std::string& name, const Request& request,
                       ResponseHeader header) {
    const auto found = pages.find(name);
    if (found == pages.end()) return empty_response(http::status::not_found, std::move(header));
    return page_response(found->second, request, std::move(header));
}

Response file_response(const ServedFiles& files, const std::vector<std::string>& segments, const Request& request,
                       ResponseHeader header) {
    auto file = files.file(segments);
    if (!file) return empty_response(http::status::not_found, std::move(header));
    header.set(http::field::etag, file->tag);
    header.set(http::field::accept_ranges, "bytes");
    header.set(http::field::cache_control, "no-cache");  // kept, but asked for again whether it is still the same
    if (names_tag(request[http::field::if_none_match], file->tag))
        return empty_response(http::status::not_modified, std::move(header));
    const auto condition = request[http::field::if_range];
    const bool ranges = condition.empty() || condition == file->tag;
    const auto part = requested_part(ranges ? request[http::field::range] : "", file->size);
    if (part.kind == FilePart::Kind::beyond) {
        header.set(http::field::content_range, "bytes */" + std::to_string(file->size));
        return empty_response(http::status::range_not_satisfiable, std::move(header));
    }
    if (part.kind == FilePart::Kind::part) {
        header.result(http::status::partial_content);
        header.set(http::field::content_range, "bytes " + std::to_string(part.first) + '-' +
                                                   std::to_string(part.first + part.count - 1) + '/' +
                                                   std::to_string(file->size));
    }
    header.set(http::field::content_type, media_type(segments.back()));
    return {.header = std::move(header), .file = std::move(*file), .first = part.first, .count = part.count};
}

std::string file_list(const ServedFiles& files) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& file : files.list()) {
        nlohmann::json entry = {{"path", file.path}, {"bytes", file.size}};
        if (!file.poster.empty()) entry["poster"] = file.poster;
        list.push_back(std::move(entry));
    }
    // Names of files may be any bytes.
    return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace htvm::live
