#include "io/gltf_uri.h"

#include <algorithm>
#include <system_error>

#include "core/letter_case.h"

namespace htvm::internal {
namespace {

bool is_letter(char c) { return lower_case(c) >= 'a' && lower_case(c) <= 'z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool begins_with(std::string_view text, std::string_view begin) {
    return text.size() >= begin.size() &&
           std::equal(begin.begin(), begin.end(), text.begin(), [](char a, char b) { return a == lower_case(b); });
}

// -1: no digit of a hexadecimal number.
int hex_digit(char c) {
    if (is_digit(c)) return c - '0';
    const char small = lower_case(c);
    return small >= 'a' && small <= 'f' ? small - 'a' + 10 : -1;
}

// Escapes that are none stay as they are: "100%.bin" is a name.
std::string without_escapes(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
        const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
        out += low < 0 ? text[i] : static_cast<char>(high * 16 + low);
        if (low >= 0) i += 2;
    }
    return out;
}

// The six bits of a letter of Base64, of either alphabet; -1: none.
int base64_digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (is_digit(c)) return c - '0' + 52;
    if (c == '+' || c == '-') return 62;
    return c == '/' || c == '_' ? 63 : -1;
}

std::optional<std::vector<std::uint8_t>> decoded_base64(std::string_view text) {
    std::vector<std::uint8_t> out;
    out.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        if (c == '=') break;
        if (c == ' ' || (c >= '\t' && c <= '\r')) continue;
        const int six = base64_digit(c);
        if (six < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(six);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        out.push_back(static_cast<std::uint8_t>(bits >> count));
    }
    return out;
}

// "http:", and "C:" too: a folder of another machine.
bool has_scheme(std::string_view uri) {
    std::size_t i = 0;
    while (i < uri.size() && (is_letter(uri[i]) || (i > 0 && (is_digit(uri[i]) || uri[i] == '+' || uri[i] == '.'))))
        ++i;
    return i > 0 && i < uri.size() && uri[i] == ':';
}

}  // namespace

bool is_data_uri(std::string_view uri) { return begins_with(uri, "data:"); }

std::optional<std::vector<std::uint8_t>> content_of_data_uri(std::string_view uri) {
    const auto comma = uri.find(',');
    if (!is_data_uri(uri) || comma == uri.npos) return std::nullopt;
    std::string kind(uri.substr(0, comma));
    kind = lower_case(kind);
    const auto content = uri.substr(comma + 1);
    const bool is_escaped = content.find('%') != content.npos;
    const auto plain = is_escaped ? without_escapes(content) : std::string();
    const std::string_view text = is_escaped ? std::string_view(plain) : content;
    if (kind.ends_with(";base64")) return decoded_base64(text);
    return std::vector<std::uint8_t>(text.begin(), text.end());
}

std::optional<std::string> name_in_uri(std::string_view uri, const std::filesystem::path& folder) {
    if (uri.empty() || has_scheme(uri)) return std::nullopt;
    const auto plain = without_escapes(uri);
    std::vector<std::string> names{plain, std::string(uri), without_escapes(uri.substr(0, uri.find_first_of("?#")))};
    for (std::size_t i = 0; i < 3; ++i) {
        auto slashed = names[i];
        std::replace(slashed.begin(), slashed.end(), '\\', '/');
        if (slashed != names[i]) names.push_back(std::move(slashed));
    }
    if (plain.find('\0') != plain.npos) return std::nullopt;
    std::error_code error;
    for (const auto& name : names)
        if (!name.empty() && !folder.empty() && std::filesystem::is_regular_file(folder / name, error)) return name;
    return plain.find('\\') == plain.npos ? plain : names[3];
}

}  // namespace htvm::internal
