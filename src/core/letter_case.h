// Letters of ASCII in lower case, whatever the locale: names of files and words of formats are compared so.
#pragma once

#include <string>
#include <string_view>

namespace htvm::internal {

inline char lower_case(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

inline std::string lower_case(std::string_view text) {
    std::string out(text);
    for (char& c : out) c = lower_case(c);
    return out;
}

}  // namespace htvm::internal
