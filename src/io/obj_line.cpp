#include "io/obj_line.h"

namespace htvm {

namespace {

// Also zero bytes and the control-Z with which old systems end a text.
bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || c == '\x1a' || c == '\0';
}

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
        const bool continues =
            line.ends_with('\\') && !text.empty() && !(joined.empty() && trimmed(line).starts_with('#'));
        if (continues) line.remove_suffix(1);
        if (joined.empty() && !continues) return line;
        joined += line;
        joined += ' ';
        if (!continues) return joined;
    }
}

std::string_view read_word(std::string_view& line) {
    std::size_t begin = 0;
    while (begin < line.size() && is_blank(line[begin])) ++begin;
    std::size_t end = begin;
    while (end < line.size() && !is_blank(line[end])) ++end;
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

std::string_view trimmed(std::string_view line) {
    while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
}

}  // namespace htvm
