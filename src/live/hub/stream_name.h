// What a live stream may be called.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace htvm::live {

// A stream's name: 1 to 64 letters, digits, '-', '_' and '.', not beginning with '.'; a rung of a ladder is a stream of
// its own and has "~1" to "~8" behind that. So it is a file's name, a segment of a path and a word of a log as it
// stands.
bool is_stream_name(std::string_view name);
inline constexpr const char* stream_name_rule =
    "a stream's name has 1 to 64 letters, digits, '-', '_' and '.', and does not begin with '.'; behind it '~' and a "
    "digit from 1 to 8 make it a rung of a ladder";

inline constexpr std::size_t most_live_rungs = 8;
// Counted from 1, the coarsest.
std::string rung_name(std::string_view ladder, std::size_t number);
// The ladder that a rung is of; other names are their own. Who may publish or watch this may so each of its rungs.
std::string_view ladder_of(std::string_view name);

}  // namespace htvm::live
