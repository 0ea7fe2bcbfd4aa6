#include "live/files/player_pages.h"

#include <boost/beast/zlib/deflate_stream.hpp>
#include <cstdint>
#include <utility>

#include "core/crc32.h"
#include "live/files/player_files.h"

namespace htvm::live {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

// What the player's pages may do; inline scripts and other sites' are forbidden.
constexpr const char* page_policy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; connect-src "
    "'self' ws: wss:; "  // a live stream's other hubs
    "img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::uint32_t checksum(std::string_view content) {
    return internal::crc32({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});
}

std::string gzipped(std::string_view content) {
    std::string out = {'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, 3};
    beast::zlib::deflate_stream deflate;
    deflate.reset(6, 15, 8, beast::zlib::Strategy::normal);
    const std::size_t begin = out.size();
    out.resize(begin + deflate.upper_bound(content.size()) + 16);
    beast::zlib::z_params params;
    params.next_in = content.data();
    params.avail_in = content.size();
    params.next_out = out.data() + begin;
    params.avail_out = out.size() - begin;
    beast::error_code error;
    deflate.write(params, beast::zlib::Flush::finish, error);
    out.resize(begin + params.total_out);
    for (const auto value : {checksum(content), static_cast<std::uint32_t>(content.size())})
        for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(value >> shift));
    return out;
}

}  // namespace

PlayerPages player_pages() {
    PlayerPages out;
    for (const auto& [name, content] : player_files())
        out.emplace(name, PlayerPage{.type = media_type(name),
                                     .content = content,
                                     .compressed = gzipped(content),
                                     .tag = '"' + std::to_string(checksum(content)) + '"'});
    return out;
}

Response page_response(const PlayerPage& page, const Request& request, ResponseHeader header) {
    header.set(http::field::etag, page.tag);
    header.set(http::field::cache_control, "no-cache");
    header.set(http::field::vary, "Accept-Encoding");
    if (page.type.starts_with("text/html")) header.set("Content-Security-Policy", page_policy);
    if (names_tag(request[http::field::if_none_match], page.tag))
        return empty_response(http::status::not_modified, std::move(header));
    const bool gzip = accepts_gzip(request[http::field::accept_encoding]);
    if (gzip) header.set(http::field::content_encoding, "gzip");
    header.set(http::field::content_type, page.type);
    return {.header = std::move(header), .content = gzip ? page.compressed : page.content};
}

}  // namespace htvm::live
