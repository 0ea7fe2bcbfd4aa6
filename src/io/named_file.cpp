#include "io/named_file.h"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/letter_case.h"

namespace htvm {

using internal::lower_case;

namespace {

namespace fs = std::filesystem;

std::string trimmed(const std::string& text) {
    constexpr const char* blanks = " \t\r\v\f";
    const std::size_t begin = text.find_first_not_of(blanks);
    if (begin == text.npos) return {};
    return text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

std::string unquoted(const std::string& text) {
    const bool is_quoted = text.size() > 2 && (text[0] == '"' || text[0] == '\'') && text.back() == text[0];
    return is_quoted ? text.substr(1, text.size() - 2) : text;
}

int hexadecimal(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

std::string without_percent_codes(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool is_code =
            text[i] == '%' && i + 2 < text.size() && hexadecimal(text[i + 1]) >= 0 && hexadecimal(text[i + 2]) >= 0;
        out += is_code ? static_cast<char>(16 * hexadecimal(text[i + 1]) + hexadecimal(text[i + 2])) : text[i];
        if (is_code) i += 2;
    }
    return out;
}

std::string without_comment(const std::string& text) {
    const std::size_t at = std::min(text.find(" #"), text.find("\t#"));
    return at == text.npos ? text : trimmed(text.substr(0, at));
}

// Everything that the name may mean, the likeliest first.
std::vector<std::string> ways_to_read(const std::string& name) {
    std::vector<std::string> out;
    const auto add = [&](const std::string& way) {
        if (!way.empty() && way.find('\0') == way.npos && std::ranges::find(out, way) == out.end()) out.push_back(way);
    };
    const std::string plain = unquoted(trimmed(name));
    add(name);
    for (const auto& way : {plain, without_percent_codes(plain), unquoted(without_comment(trimmed(name)))}) {
        std::string rest = way;
        std::replace(rest.begin(), rest.end(), '\\', '/');
        add(rest);
        for (std::size_t slash; (slash = rest.find('/')) != rest.npos;) {
            rest.erase(0, slash + 1);
            add(rest);
        }
    }
    return out;
}

}  // namespace

NamedPlace named_place(const fs::path& folder, const fs::path& path) {
    std::error_code error;
    // A name that is too long for the system is an error, and no file.
    if (!fs::is_regular_file(path, error)) return NamedPlace::nowhere;
    const auto within = fs::canonical(folder, error);
    const auto file = error ? fs::path() : fs::canonical(path, error);
    if (error) return NamedPlace::nowhere;
    const bool is_inside = std::mismatch(within.begin(), within.end(), file.begin(), file.end()).first == within.end();
    return is_inside ? NamedPlace::inside : NamedPlace::outside;
}

const NamedFiles::Listing& NamedFiles::names_in(const fs::path& folder) {
    const auto [at, is_new] = listings_.try_emplace(folder);
    if (!is_new) return at->second;
    std::error_code error;
    for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::directory_iterator();
         entry.increment(error)) {
        const auto name = entry->path().filename().string();
        const auto [known, is_first] = at->second.emplace(lower_case(name), name);
        if (!is_first) known->second = std::min(known->second, name);  // not in the order of the disk
    }
    return at->second;
}

std::optional<fs::path> NamedFiles::find_in_either_case(const fs::path& folder, const std::string& name) {
    fs::path path = folder;
    for (const auto& part : fs::path(name).relative_path()) {
        if (part.empty() || part == "." || part == "..") {
            path /= part;
            continue;
        }
        const auto& names = names_in(path);
        const auto found = names.find(lower_case(part.string()));
        if (found == names.end()) return std::nullopt;
        path /= found->second;
    }
    return path;
}

std::optional<fs::path> NamedFiles::find(const fs::path& folder, const std::string& name) {
    constexpr std::size_t longest = 4096;
    if (name.size() > longest) return std::nullopt;
    const auto ways = ways_to_read(name);
    for (const auto& way : ways)
        if (named_place(folder, folder / way) == NamedPlace::inside) return folder / way;
    for (const auto& way : ways) {
        const auto tried = find_in_either_case(folder, way);
        if (tried && named_place(folder, *tried) == NamedPlace::inside) return tried;
    }
    return std::nullopt;
}

}  // namespace htvm
