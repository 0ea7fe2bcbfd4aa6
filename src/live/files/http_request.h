// A request as Boost.Beast reads it, and the parts of it that are parsed here: which path it names, with which query,
// and what its headers say of files.
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace htvm::live {

// None has a body.
using Request = boost::beast::http::request<boost::beast::http::empty_body>;

// The decoded segments of a request target's path; the query is dropped. Nothing if a segment is empty (except after a
// final slash), begins with a dot, or holds a slash, backslash or control character, if an escape is wrong, or if the
// path is longer than 1,024 bytes or has more than 16 segments. So the segments never lead upwards or to hidden files.
std::optional<std::vector<std::string>> path_segments(std::string_view target);

// The decoded value of this member of the target's query: "2" of "?a=1&b=2"; "" of a name without a value. Nothing if
// the query has no such member, its escapes are wrong, or it holds a control character. Where there are several, the
// first counts.
std::optional<std::string> query_value(std::string_view target, std::string_view name);

// All of the text, decimal digits only; nothing if it is no such number or 2^64 or more.
std::optional<std::uint64_t> whole_number(std::string_view text);

// Which bytes of a file to send.
struct FilePart {
    enum class Kind { whole, part, beyond };  // answered by 200, 206, 416
    Kind kind = Kind::whole;
    std::uint64_t first = 0, count = 0;  // of a part: at least one byte
};

// From a Range header, "" if there is none. Headers that are malformed, in other units or name several ranges are
// ignored, as RFC 9110 allows.
FilePart requested_part(std::string_view range, std::uint64_t size);

// Whether a list of entity tags, as in If-None-Match, has this one or is "*". Weak tags match too.
bool names_tag(std::string_view list, std::string_view tag);

// Host and port of the site that an Origin header names: "a.example:8080" of "https://a.example:8080"; "" if it is
// none, such as "null".
std::string_view host_of_origin(std::string_view origin);

// Whether a Host header names this machine's loopback address, with this port or none. A page of another site whose
// name was made to lead here (DNS rebinding) sends that name.
bool names_loopback(std::string_view host, std::uint16_t port);

// Whether an Accept-Encoding header allows gzip.
bool accepts_gzip(std::string_view header);

}  // namespace htvm::live
