// Numbers in text files, the same in every locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace htvm {

// The number that the whole of `text` is: decimal, with optional sign, point and exponent; "nan" and "inf" give
// themselves, too large a magnitude gives an infinity. Nothing where the text is anything else.
std::optional<double> parse_number(std::string_view text);

// Appends the shortest text that parse_number and a conversion to float bring back exactly.
void append_number(std::string& text, float value);

}  // namespace htvm
