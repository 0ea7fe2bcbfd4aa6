// What a live stream may be called.
#pragma once

#include <string_view>

namespace htvm::live {

// A stream's name: 1 to 64 letters, digits, '-', '_' and '.', not beginning with '.'. So it is a file's name, a segment
// of a path and a word of a log as it stands.
bool is_stream_name(std::string_view name);
inline constexpr const char* stream_name_rule =
    "a stream's name has 1 to 64 letters, digits, '-', '_' and '.', and does not begin with '.'";

}  // namespace htvm::live
