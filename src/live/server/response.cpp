#include "live/server/response.h"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/write.hpp>
#include <utility>
#include <vector>

namespace htvm::live {

namespace net = boost::asio;
namespace http = boost::beast::http;

constexpr auto awaited = net::as_tuple(net::use_awaitable);
constexpr std::size_t piece_bytes = 65536;

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

Response text_response(SharedText::Text text, const char* type, ResponseHeader header) {
    auto out = text_response(std::string(), type, std::move(header));
    out.shared = std::move(text);
    return out;
}

Response refusing_response(const Refusal& refusal, ResponseHeader header) {
    header.result(refusal.status);
    return text_response(refusal.why + '\n', "text/plain; charset=utf-8", std::move(header));
}

net::awaitable<bool> send(Line& line, Response& response, bool with_body, std::chrono::seconds stall_time) {
    auto& header = response.header;
    if (!response.own.empty()) response.content = response.own;
    if (response.shared) response.content = *response.shared;
    const bool text = response.file.file.descriptor() < 0;
    const auto count = text ? response.content.size() : response.count;
    if (header.result() != http::status::not_modified) header.set(http::field::content_length, std::to_string(count));
    http::response_serializer<http::empty_body> serializer(header);
    line.expires_after(stall_time);
    if (const auto [error, bytes] = co_await http::async_write_header(line, serializer, awaited); error)
        co_return false;
    if (!with_body) co_return true;
    std::vector<char> piece(text ? 0 : std::min<std::uint64_t>(piece_bytes, count));
    for (std::uint64_t sent = 0; sent < count;) {
        std::string_view next;
        if (text) {
            next = response.content.substr(sent, piece_bytes);
        } else {
            const auto wanted = std::min<std::uint64_t>(piece.size(), count - sent);
            next = {piece.data(), response.file.file.read(response.first + sent, {piece.data(), wanted})};
        }
        if (next.empty()) co_return false;  // the file has become shorter than was promised
        line.expires_after(stall_time);
        const auto [error, bytes] = co_await net::async_write(line, net::buffer(next), awaited);
        if (error) co_return false;
        sent += bytes;
    }
    co_return true;
}

}  // namespace htvm::live
