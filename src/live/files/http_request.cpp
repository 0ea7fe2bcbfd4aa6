#include "live/files/http_request.h"

#include <algorithm>
#include <charconv>

namespace htvm::live {
namespace {

constexpr std::size_t most_path_bytes = 1024, most_segments = 16;

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

// Removes and returns what comes before the next separator.
std::string_view next_item(std::string_view& text, char separator) {
    const auto end = std::min(text.find(separator), text.size());
    const auto item = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return item;
}

// All of the text, digits only.
template <class Number>
std::optional<Number> number(std::string_view text, int base = 10) {
    Number value = 0;
    if (text.empty() || text.front() == '-') return std::nullopt;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<std::string> unescaped(std::string_view text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        char c = text[i];
        if (c == '%') {
            if (i + 2 >= text.size()) return std::nullopt;
            const auto value = number<unsigned char>(text.substr(i + 1, 2), 16);
            if (!value) return std::nullopt;
            c = static_cast<char>(*value);
            i += 2;
        }
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f) return std::nullopt;
        out.push_back(c);
    }
    return out;
}

}  // namespace

std::optional<std::vector<std::string>> path_segments(std::string_view target) {
    auto path = target.substr(0, target.find_first_of("?#"));
    if (path.empty() || path.front() != '/' || path.size() > most_path_bytes) return std::nullopt;
    path.remove_prefix(1);
    std::vector<std::string> segments;
    while (!path.empty()) {
        auto segment = unescaped(next_item(path, '/'));
        if (!segment || segment->empty() || segment->front() == '.') return std::nullopt;
        if (segment->find_first_of("/\\") != std::string::npos) return std::nullopt;
        if (segments.size() == most_segments) return std::nullopt;
        segments.push_back(std::move(*segment));
    }
    return segments;
}

std::optional<std::string> query_value(std::string_view target, std::string_view name) {
    target = target.substr(0, target.find('#'));
    auto query = target.substr(std::min(target.find('?'), target.size()));
    if (!query.empty()) query.remove_prefix(1);
    while (!query.empty()) {
        auto value = next_item(query, '&');
        if (next_item(value, '=') == name) return unescaped(value);
    }
    return std::nullopt;
}

std::optional<std::uint64_t> whole_number(std::string_view text) { return number<std::uint64_t>(text); }

FilePart requested_part(std::string_view range, std::uint64_t size) {
    const FilePart whole{FilePart::Kind::whole, 0, size};
    constexpr std::string_view unit = "bytes=";
    if (!range.starts_with(unit)) return whole;
    range = trimmed(range.substr(unit.size()));
    const auto dash = range.find('-');
    if (dash == std::string_view::npos) return whole;
    const auto first = range.substr(0, dash), last = range.substr(dash + 1);
    const auto to = number<std::uint64_t>(last);
    if (!last.empty() && !to) return whole;
    if (first.empty()) {  // the last bytes
        if (!to) return whole;
        if (*to == 0 || size == 0) return {FilePart::Kind::beyond, 0, 0};
        const auto count = std::min(*to, size);
        return {FilePart::Kind::part, size - count, count};
    }
    const auto from = number<std::uint64_t>(first);
    if (!from || (to && *to < *from)) return whole;
    if (*from >= size) return {FilePart::Kind::beyond, 0, 0};
    const auto end = to ? std::min(*to, size - 1) : size - 1;
    return {FilePart::Kind::part, *from, end - *from + 1};
}

bool names_tag(std::string_view list, std::string_view tag) {
    while (!list.empty()) {
        auto item = trimmed(next_item(list, ','));
        if (item == "*") return true;
        if (item.starts_with("W/")) item.remove_prefix(2);
        if (item == tag) return true;
    }
    return false;
}

std::string_view host_of_origin(std::string_view origin) {
    constexpr std::string_view after_scheme = "://";
    const auto found = origin.find(after_scheme);
    return found == std::string_view::npos ? "" : origin.substr(found + after_scheme.size());
}

bool names_loopback(std::string_view host, std::uint16_t port) {
    const auto suffix = ':' + std::to_string(port);
    if (host.ends_with(suffix)) host.remove_suffix(suffix.size());
    return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

bool accepts_gzip(std::string_view header) {
    while (!header.empty()) {
        auto item = next_item(header, ',');
        const auto coding = trimmed(next_item(item, ';'));
        if (coding != "gzip") continue;
        const auto weight = trimmed(item);
        return weight != "q=0" && weight != "q=0.0" && weight != "q=0.00" && weight != "q=0.000";
    }
    return false;
}

}  // namespace htvm::live
