#include "io/obj_material.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/letter_case.h"
#include "io/colour_range.h"
#include "io/number_text.h"

namespace htvm {

using internal::lower_case;

namespace {

constexpr const char* blanks = " \t\v\f";

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(blanks);
    if (begin == text.npos) return {};
    return text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

// Removes the next word from the line and returns it; empty at its end.
std::string_view read_word(std::string_view& line) {
    const std::size_t begin = line.find_first_not_of(blanks);
    if (begin == line.npos) return line = {};
    const std::size_t end = std::min(line.find_first_of(blanks, begin), line.size());
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

// Removes the next line from the text and returns it; lines continued with a backslash are put together in `joined`.
std::string_view read_line(std::string_view& text, std::string& joined) {
    joined.clear();
    for (;;) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        std::string_view line = text.substr(0, end);
        const bool is_pair = text.substr(end).starts_with("\r\n");
        text.remove_prefix(std::min(end + (is_pair ? 2 : 1), text.size()));
        const bool continues = line.ends_with('\\') && !text.empty();
        if (continues) line.remove_suffix(1);
        if (joined.empty() && !continues) return line;
        joined += line;
        joined += ' ';
        if (!continues) return joined;
    }
}

// An option of a map: how many words follow, of which those that are numbers may be left out, and the numbers that
// change nothing.
struct MapOption {
    std::string_view name;
    int words;
    bool takes_text;
    std::optional<double> neutral;
};
constexpr std::array map_options = {
    MapOption{"-s", 3, false, 1},       MapOption{"-o", 3, false, 0},          MapOption{"-t", 3, false, 0},
    MapOption{"-mm", 2, false, {}},     MapOption{"-bm", 1, false, {}},        MapOption{"-boost", 1, false, {}},
    MapOption{"-texres", 1, false, {}}, MapOption{"-blendu", 1, true, {}},     MapOption{"-blendv", 1, true, {}},
    MapOption{"-clamp", 1, true, {}},   MapOption{"-cc", 1, true, {}},         MapOption{"-imfchan", 1, true, {}},
    MapOption{"-type", 1, true, {}},    MapOption{"-colorspace", 1, true, {}},
};

struct MapStatement {
    std::string image;
    bool is_placed = false;
};

// What follows map_Kd and the like: options, and a name that may hold blanks.
MapStatement read_map(std::string_view line) {
    MapStatement out;
    for (;;) {
        std::string_view rest = line;
        const std::string name = lower_case(read_word(rest));
        const auto option = std::ranges::find(map_options, name, &MapOption::name);
        if (option == map_options.end()) break;
        for (int left = option->words; left > 0; --left) {
            std::string_view behind = rest;
            const auto number = parse_number(read_word(behind));
            if (!option->takes_text && !number) break;
            if (option->neutral && number != option->neutral) out.is_placed = true;
            rest = behind;
        }
        line = rest;
    }
    out.image = trimmed(line);
    std::replace(out.image.begin(), out.image.end(), '\\', '/');
    return out;
}

// One number is a grey; a spectral curve or another space of colours is none.
std::optional<Colour> read_colour(std::string_view line) {
    std::array<double, 3> levels{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto word = read_word(line);
        const auto level = parse_number(word);
        if (word.empty() && i > 0) {
            levels[i] = levels[0];
            continue;
        }
        if (!level || !std::isfinite(*level)) return std::nullopt;
        levels[i] = *level;
    }
    Colour out;
    for (std::size_t i = 0; i < 3; ++i) out[i] = colour_level(levels[i], ColourRange::unit);
    return out;
}

// How much an image is worth as the colour's: the better of two stays.
int rank_of_map(std::string_view keyword) {
    if (keyword == "map_kd") return 3;
    if (keyword == "map_ka") return 2;
    return keyword == "map_ke" ? 1 : 0;
}

// Splits at blanks, except in quotes.
std::vector<std::string> words_of(std::string_view line) {
    std::vector<std::string> out;
    while (!(line = trimmed(line)).empty()) {
        const bool is_quoted = line.front() == '"' && line.find('"', 1) != line.npos;
        const std::size_t begin = is_quoted ? 1 : 0;
        const std::size_t end = is_quoted ? line.find('"', 1) : std::min(line.find_first_of(blanks), line.size());
        if (end > begin) out.emplace_back(line.substr(begin, end - begin));
        line.remove_prefix(std::min(end + begin, line.size()));
    }
    return out;
}

}  // namespace

std::vector<ObjMaterial> read_obj_materials(std::string_view text) {
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
    std::vector<ObjMaterial> out;
    std::string joined;
    int rank = 0;  // of the last material's image
    while (!text.empty()) {
        std::string_view line = read_line(text, joined);
        const std::string keyword = lower_case(read_word(line));
        if (keyword == "newmtl") {
            out.emplace_back().name = trimmed(line);
            rank = 0;
        }
        if (out.empty()) continue;
        auto& material = out.back();
        if (keyword == "kd") material.colour = read_colour(line);
        const int own = rank_of_map(keyword);
        if (own == 0 || own < rank) continue;
        auto map = read_map(line);
        if (map.image.empty()) continue;
        rank = own;
        material.image = std::move(map.image);
        material.is_placed = map.is_placed;
        material.is_substitute = keyword != "map_kd";
    }
    return out;
}

const ObjMaterial* find_material(const std::vector<ObjMaterial>& materials, std::string_view name) {
    auto found = std::ranges::find(materials, name, &ObjMaterial::name);
    if (found == materials.end())
        found = std::ranges::find_if(materials, [wanted = lower_case(name)](const auto& material) {
            return lower_case(material.name) == wanted;
        });
    return found == materials.end() ? nullptr : &*found;
}

std::vector<std::vector<std::string>> material_file_names(std::string_view line) {
    line = trimmed(line);
    if (line.empty()) return {};
    std::vector<std::vector<std::string>> out{{std::string(line)}};
    const auto words = words_of(line);
    constexpr std::string_view ending = ".mtl";
    std::vector<std::string> by_ending;
    bool is_whole = true;  // the name ends with its last word
    for (const auto& word : words) {
        if (is_whole)
            by_ending.push_back(word);
        else
            by_ending.back().append(" ").append(word);
        is_whole = lower_case(word).ends_with(ending);
    }
    for (const auto& way : {by_ending, words})
        if (!way.empty() && std::ranges::find(out, way) == out.end()) out.push_back(way);
    return out;
}

}  // namespace htvm
