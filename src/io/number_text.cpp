#include "io/number_text.h"

#include <charconv>
#include <limits>

namespace htvm {

std::optional<double> parse_number(std::string_view text) {
    if (!text.empty() && text.front() == '+') {
        text.remove_prefix(1);
        if (!text.empty() && text.front() == '-') return std::nullopt;
    }
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        const bool tiny = text.find("e-") != text.npos || text.find("E-") != text.npos;
        return tiny ? 0.0 : std::numeric_limits<double>::infinity();
    }
    return value;
}

std::optional<double> parse_measurement(std::string_view text) {
    if (const auto number = parse_number(text)) return number;
    const bool is_negative = text.starts_with('-');
    const auto magnitude = text.substr(is_negative || text.starts_with('+') ? 1 : 0);
    if (magnitude.starts_with("1.#")) {
        const double infinity = std::numeric_limits<double>::infinity();
        if (!magnitude.substr(3).starts_with("INF")) return std::numeric_limits<double>::quiet_NaN();
        return is_negative ? -infinity : infinity;
    }
    const std::size_t comma = text.find(',');
    if (comma == text.npos || text.find('.') != text.npos) return std::nullopt;
    std::string with_point(text);
    with_point[comma] = '.';
    return parse_number(with_point);
}

namespace {

template <class Number>
void append_shortest(std::string& text, Number value) {
    char digits[32];
    const auto result = std::to_chars(digits, digits + sizeof digits, value);
    text.append(digits, result.ptr);
}

}  // namespace

void append_number(std::string& text, float value) { append_shortest(text, value); }
void append_number(std::string& text, double value) { append_shortest(text, value); }

}  // namespace htvm
