#include "io/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

namespace htvm {

namespace {

std::optional<PlyType> type_named(std::string_view name) {
    static constexpr std::array<std::pair<std::string_view, PlyType>, 16> names{{
        {"char", PlyType::i8},
        {"int8", PlyType::i8},
        {"uchar", PlyType::u8},
        {"uint8", PlyType::u8},
        {"short", PlyType::i16},
        {"int16", PlyType::i16},
        {"ushort", PlyType::u16},
        {"uint16", PlyType::u16},
        {"int", PlyType::i32},
        {"int32", PlyType::i32},
        {"uint", PlyType::u32},
        {"uint32", PlyType::u32},
        {"float", PlyType::f32},
        {"float32", PlyType::f32},
        {"double", PlyType::f64},
        {"float64", PlyType::f64},
    }};
    for (const auto& [known, type] : names) {
        if (known == name) return type;
    }
    return std::nullopt;
}

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" \t\r", at)) != line.npos) {
        const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
        words.push_back(line.substr(at, end - at));
        at = end;
    }
    return words;
}

tl::unexpected<Error> bad_line(std::string_view line, const std::string& why) {
    return fail(ErrorKind::bad_input,
                "the PLY header's line \"" + std::string(line.substr(0, 80)) + "\" cannot be read: " + why);
}

Result<void> read_format(PlyHeader& header, const std::vector<std::string_view>& words, std::string_view line) {
    if (words.size() < 2) return bad_line(line, "the format is missing");
    if (words[1] == "ascii") {
        header.format = PlyFormat::ascii;
    } else if (words[1] == "binary_little_endian") {
        header.format = PlyFormat::binary_little_endian;
    } else if (words[1] == "binary_big_endian") {
        header.format = PlyFormat::binary_big_endian;
    } else {
        return bad_line(line, "the format is none of ascii, binary_little_endian, binary_big_endian");
    }
    if (words.size() > 2 && words[2] != "1.0") return fail(ErrorKind::unsupported, "only version 1.0 of PLY is read");
    return {};
}

Result<void> read_element(PlyHeader& header, const std::vector<std::string_view>& words, std::string_view line) {
    if (words.size() != 3) return bad_line(line, "an element has a name and a count");
    if (header.elements.size() == most_ply_elements)
        return fail(ErrorKind::limit, "the PLY declares too many elements");
    PlyElement element;
    element.name = words[1];
    for (const PlyElement& other : header.elements) {
        if (other.name == element.name) return bad_line(line, "this element was declared before");
    }
    const char* end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
    if (error != std::errc() || stop != end) return bad_line(line, "the count is not a whole number");
    header.elements.push_back(std::move(element));
    return {};
}

Result<void> read_property(PlyHeader& header, const std::vector<std::string_view>& words, std::string_view line) {
    if (header.elements.empty()) return bad_line(line, "a property must follow its element");
    PlyProperty property;
    property.is_list = words.size() > 1 && words[1] == "list";
    const std::size_t expected = property.is_list ? 5 : 3;
    if (words.size() != expected) return bad_line(line, "a property has a type and a name");
    if (property.is_list) {
        const auto count_type = type_named(words[2]);
        if (!count_type || *count_type == PlyType::f32 || *count_type == PlyType::f64) {
            return bad_line(line, "a list's length must have an integer type");
        }
        property.count_type = *count_type;
    }
    const auto type = type_named(words[expected - 2]);
    if (!type) return bad_line(line, "the type is unknown");
    property.type = *type;
    property.name = words[expected - 1];
    header.elements.back().properties.push_back(std::move(property));
    return {};
}

}  // namespace

std::size_t ply_type_size(PlyType type) {
    switch (type) {
        case PlyType::i8:
        case PlyType::u8:
            return 1;
        case PlyType::i16:
        case PlyType::u16:
            return 2;
        case PlyType::i32:
        case PlyType::u32:
        case PlyType::f32:
            return 4;
        case PlyType::f64:
            break;
    }
    return 8;
}

std::uint64_t fewest_element_bytes(const PlyElement& element, PlyFormat format) {
    if (format == PlyFormat::ascii) return 2 * element.properties.size();
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
        bytes += ply_type_size(property.is_list ? property.count_type : property.type);
    }
    return bytes;
}

Result<bool> read_ply_header_line(PlyHeader& header, std::string_view line) {
    const std::vector<std::string_view> words = words_of(line);
    if (words.size() > 2 && words[0] == "comment" && words[1] == "timestamp") {
        header.timestamp = words[2];
        if (words.size() > 3) header.timestamp.append(" ").append(words[3]);  // its unit
    }
    if (words.size() == 3 && words[0] == "comment" && words[1] == "fps") header.fps = words[2];
    if (words.size() > 2 && words[0] == "comment" && words[1] == "TextureFile") {
        const auto begin = static_cast<std::size_t>(words[2].data() - line.data());  // the name may hold spaces
        header.texture = line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
    }
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return false;
    if (words[0] == "end_header") return true;
    Result<void> read;
    if (words[0] == "format") {
        read = read_format(header, words, line);
    } else if (words[0] == "element") {
        read = read_element(header, words, line);
    } else if (words[0] == "property") {
        read = read_property(header, words, line);
    } else {
        return bad_line(line, "it is none of format, element, property, comment, obj_info, end_header");
    }
    if (!read) return tl::unexpected(read.error());
    return false;
}

}  // namespace htvm
