// Words of files and of the other side, for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace htvm::app {

// The text with its control characters, by which a terminal could be told to do something, spelled \xNN; those of
// several bytes (U+0080 to U+009F), too.
std::string visible(std::string_view text);
// Likewise, but ends of lines stay.
std::string visible_lines(std::string_view text);

}  // namespace htvm::app
