// What goes back over a connection: a header, and behind it a text or a part of a file.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "live/client/line.h"
#include "live/server/refusals.h"
#include "live/server/served_files.h"
#include "live/server/shared_text.h"

namespace htvm::live {

using ResponseHeader = boost::beast::http::response<boost::beast::http::empty_body>;

struct Response {
    ResponseHeader header;
    std::string own{};           // a text made for this response,
    std::string_view content{};  // or one that outlives it,
    SharedText::Text shared{};   // or one that several have,
    SharedText::Text keeps{};    // or, in `content`, a part of this one,
    ServedFile file{};           // or a part of a file
    std::uint64_t first = 0, count = 0;
};

// The media type of a file by the end of its name.
std::string_view media_type(std::string_view name);

// A response with nothing but a header.
Response empty_response(boost::beast::http::status status, ResponseHeader header);
// A text that is made anew for each response.
Response text_response(std::string text, const char* type, ResponseHeader header);
Response text_response(SharedText::Text text, const char* type, ResponseHeader header);
// The sentence that says why.
Response refusing_response(const Refusal& refusal, ResponseHeader header);

// Sends it. stall_time: for the other side to take the next 64 KB. False if the connection is of no use any more.
boost::asio::awaitable<bool> send(Line& line, Response& response, bool with_body, std::chrono::seconds stall_time);

}  // namespace htvm::live
