// What goes back over a connection: a header, and behind it a text or a part of a file.
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "live/files/served_files.h"

namespace htvm::live {

using ResponseHeader = boost::beast::http::response<boost::beast::http::empty_body>;

// A text that several responses have.
using SharedBody = std::shared_ptr<const std::string>;

struct Response {
    ResponseHeader header;
    std::string own{};           // a text made for this response,
    std::string_view content{};  // or one that outlives it,
    SharedBody shared{};         // or one that several have,
    SharedBody keeps{};          // or, in `content`, a part of this one,
    ServedFile file{};           // or a part of a file
    std::uint64_t first = 0, count = 0;
};

// The media type of a file by the end of its name.
std::string_view media_type(std::string_view name);

// A response with nothing but a header.
Response empty_response(boost::beast::http::status status, ResponseHeader header);
// A text that is made anew for each response.
Response text_response(std::string text, const char* type, ResponseHeader header);
Response text_response(SharedBody text, const char* type, ResponseHeader header);
// A sentence that says why something else is not sent.
Response sentence_response(boost::beast::http::status status, const std::string& why, ResponseHeader header);

}  // namespace htvm::live
