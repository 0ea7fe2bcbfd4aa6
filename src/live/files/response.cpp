#include "live/files/response.h"

#include <utility>

namespace htvm::live {

namespace http = boost::beast::http;

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
        {".m3u8", "application/vnd.apple.mpegurl"},
        {".m4s", "video/mp4"},
        {".mp4", "video/mp4"},
    };
    for (const auto& [ending, type] : types)
        if (name.ends_with(ending)) return type;
    return "application/octet-stream";
}

Response empty_response(http::status status, ResponseHeader header) {
    header.result(status);
    return {.header = std::move(header)};
}

Response text_response(std::string text, const char* type, ResponseHeader header) {
    header.set(http::field::content_type, type);
    header.set(http::field::cache_control, "no-store");
    return {.header = std::move(header), .own = std::move(text)};
}

Response text_response(SharedBody text, const char* type, ResponseHeader header) {
    auto out = text_response(std::string(), type, std::move(header));
    out.shared = std::move(text);
    return out;
}

Response sentence_response(http::status status, const std::string& why, ResponseHeader header) {
    header.result(status);
    return text_response(why + '\n', "text/plain; charset=utf-8", std::move(header));
}

}  // namespace htvm::live
