#include "io/obj_line.h"

#include <algorithm>

namespace htvm {

namespace {

// Also zero bytes and the control-Z with which old systems end a text.
constexpr std::string_view blanks{" \t\r\v\f\x1a\0", 7};

// The length of the line's end, at which the text begins.
std::size_t length_of_end(std::string_view text) {
    if (text.starts_with("\r\n")) return 2;
    return text.starts_with("\n\r") && !text.starts_with("\n\r\n") ? 2 : 1;
}

}  // namespace

std::string_view read_line(std::string_view& text, std::size_t& line_number, std::string& joined) {
    joined.clear();
    for (;;) {
        std::size_t end = 0;
        while (end < text.size() && text[end] != '\n' && text[end] != '\r') ++end;
        std::string_view line = text.substr(0, end);
        text.remove_prefix(end);
        if (!text.empty()) text.remove_prefix(length_of_end(text));
        ++line_number;
        const bool is_comment = joined.empty() && trimmed(line).starts_with('#');
        const bool continues = line.ends_with('\\') && !text.empty() && !is_comment;
        if (continues) line.remove_suffix(1);
        if (joined.empty() && !continues) return line;
        joined += line;
        joined += ' ';
        if (!continues) return joined;
    }
}

std::string_view read_word(std::string_view& line) {
    const std::size_t begin = line.find_first_not_of(blanks);
    if (begin == line.npos) return line = {};
    const std::size_t end = std::min(line.find_first_of(blanks, begin), line.size());
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

std::string_view trimmed(std::string_view line) {
    const std::size_t begin = line.find_first_not_of(blanks);
    if (begin == line.npos) return {};
    return line.substr(begin, line.find_last_not_of(blanks) + 1 - begin);
}

}  // namespace htvm
