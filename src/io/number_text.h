// Numbers in text files, independent of the locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace htvm {

// The number that `text`, as a whole, represents: decimal, with optional sign, point and exponent; "nan" and "inf" are
// accepted, and too large a magnitude gives infinity. Nothing if the text is anything else.
std::optional<double> parse_number(std::string_view text);

// The same of measurements, as programs of many kinds write them: also "1.#QNAN", "-1.#IND" and "1.#INF", as older
// runtimes of Windows have them (the first two are not a number), and with a decimal comma ("1,5").
std::optional<double> parse_measurement(std::string_view text);

// Appends the shortest text that parse_number and a conversion to float turn back into exactly this value.
void append_number(std::string& text, float value);
// The same for a double.
void append_number(std::string& text, double value);

}  // namespace htvm
