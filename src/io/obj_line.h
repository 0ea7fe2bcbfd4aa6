// Lines and words of the text files of Wavefront: OBJ and its materials.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace htvm {

// Removes the next line from the text and returns it without its end: LF, CR LF, CR or LF CR. Lines continued with a
// backslash are put together in `joined`, unless they are comments. line_number: of the line's end, counted from 1.
std::string_view read_line(std::string_view& text, std::size_t& line_number, std::string& joined);

// Removes the next word from the line and returns it; empty at its end.
std::string_view read_word(std::string_view& line);

// What is left of the line: a name that may hold blanks.
std::string_view trimmed(std::string_view line);

}  // namespace htvm
