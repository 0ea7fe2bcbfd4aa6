#include "io/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <utility>

#include "core/letter_case.h"
#include "io/number_text.h"

namespace htvm {

using internal::lower_case;

namespace {

// name: in lower case.
std::optional<PlyType> type_named(std::string_view name) {
    static constexpr std::array<std::pair<std::string_view, PlyType>, 24> names{{
        {"char", PlyType::i8},   {"int8", PlyType::i8},     {"uchar", PlyType::u8},    {"uint8", PlyType::u8},
        {"short", PlyType::i16}, {"int16", PlyType::i16},   {"ushort", PlyType::u16},  {"uint16", PlyType::u16},
        {"int", PlyType::i32},   {"int32", PlyType::i32},   {"uint", PlyType::u32},    {"uint32", PlyType::u32},
        {"long", PlyType::i64},  {"int64", PlyType::i64},   {"ulong", PlyType::u64},   {"uint64", PlyType::u64},
        {"float", PlyType::f32}, {"float32", PlyType::f32}, {"double", PlyType::f64},  {"float64", PlyType::f64},
        {"int8_t", PlyType::i8}, {"uint8_t", PlyType::u8},  {"int32_t", PlyType::i32}, {"uint32_t", PlyType::u32},
    }};
    for (const auto& [known, type] : names) {
        if (known == name) return type;
    }
    return std::nullopt;
}

constexpr const char* blanks = " \t\r\n\v\f";

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while ((at = line.find_first_not_of(blanks, at)) != line.npos) {
        const std::size_t end = std::min(line.find_first_of(blanks, at), line.size());
        words.push_back(line.substr(at, end - at));
        at = end;
    }
    return words;
}

tl::unexpected<Error> bad_line(std::string_view line, const std::string& why) {
    return fail(ErrorKind::bad_input,
                "the PLY header's line \"" + std::string(line.substr(0, 80)) + "\" cannot be read: " + why);
}

// words: of the line, those of meaning in lower case.
using Words = std::vector<std::string>;

Result<void> read_format(PlyHeader& header, const Words& words, std::string_view line) {
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
    if (words.size() > 2 && parse_number(words[2]) != 1)
        return fail(ErrorKind::unsupported, "only version 1.0 of PLY is read");
    return {};
}

Result<void> read_element(PlyHeader& header, const Words& words, std::string_view line) {
    if (words.size() < 3) return bad_line(line, "an element has a name and a count");
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

// words: without "property".
Result<void> read_property(PlyHeader& header, std::span<const std::string> words, std::string_view line) {
    if (header.elements.empty()) return bad_line(line, "a property must follow its element");
    PlyProperty property;
    property.is_list = !words.empty() && words[0] == "list";
    const std::size_t expected = property.is_list ? 4 : 2;
    if (words.size() < expected) return bad_line(line, "a property has a type and a name");
    if (property.is_list) {
        const auto count_type = type_named(words[1]);
        if (!count_type || !is_ply_integer(*count_type))
            return bad_line(line, "a list's length must have an integer type");
        property.count_type = *count_type;
    }
    const auto type = type_named(words[expected - 2]);
    if (!type) return bad_line(line, "the type is unknown");
    property.type = *type;
    property.name = words[expected - 1];
    header.elements.back().properties.push_back(std::move(property));
    return {};
}

// A comment that says something. words: of the line as it stands.
Result<void> read_comment(PlyHeader& header, std::span<const std::string_view> words, std::string_view line) {
    if (words.size() < 3) return {};
    const std::string about = lower_case(words[1]);
    if (about == "timestamp") {
        header.timestamp = words[2];
        if (words.size() > 3) header.timestamp.append(" ").append(words[3]);  // its unit
    }
    if (about == "fps" && words.size() == 3) header.fps = words[2];
    if (about != "texturefile") return {};
    if (header.textures.size() == most_ply_textures)
        return fail(ErrorKind::limit, "the PLY names more than " + std::to_string(most_ply_textures) + " images");
    const auto begin = static_cast<std::size_t>(words[2].data() - line.data());  // the name may hold spaces
    auto name = line.substr(begin, line.find_last_not_of(blanks) + 1 - begin);
    if (name.size() > 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
    header.textures.emplace_back(name);
    return {};
}

struct HeaderState {
    PlyHeader header;
    bool has_format = false;
    bool has_ended = false;
};

Result<void> read_header_line(HeaderState& state, std::string_view line) {
    const std::vector<std::string_view> as_written = words_of(line);
    if (as_written.empty()) return {};
    const std::string keyword = lower_case(as_written[0]);
    if (keyword == "comment" || keyword == "obj_info") return read_comment(state.header, as_written, line);
    Words words;
    for (const auto word : as_written) words.push_back(lower_case(word));
    state.has_ended = keyword == "end_header";
    if (state.has_ended) return {};
    if (keyword == "format") {
        state.has_format = true;
        return read_format(state.header, words, line);
    }
    if (keyword == "element") return read_element(state.header, words, line);
    if (keyword == "property") return read_property(state.header, std::span(words).subspan(1), line);
    if (!state.header.elements.empty() && (keyword == "list" || type_named(keyword)))
        return read_property(state.header, words, line);
    return bad_line(line, "it is none of format, element, property, comment, obj_info, end_header");
}

// What ends the lines of a header: the character, and whether a CR follows it.
struct LineEnd {
    char last = '\n';
    bool cr_follows = false;
};

// Reads "ply" and what ends its line; nothing if that is not there.
std::optional<LineEnd> read_first_line(PlySource& source) {
    constexpr std::size_t length = 3;
    if (!skip_to_ply(source) || !source.ensure(length)) return std::nullopt;
    if (lower_case({reinterpret_cast<const char*>(source.cursor()), length}) != "ply") return std::nullopt;
    source.advance(length);
    bool saw_cr = false;
    for (std::size_t read = 0; read < most_ply_header_bytes && source.ensure(1); ++read) {
        const char c = static_cast<char>(*source.cursor());
        if (c == '\n') {
            source.advance(1);
            // A CR and an LF that follow are an empty line of another kind.
            const bool cr_follows = source.ensure(2) && source.cursor()[0] == '\r' && source.cursor()[1] != '\n';
            if (cr_follows) source.advance(1);
            return LineEnd{'\n', cr_follows};
        }
        saw_cr = saw_cr || c == '\r';
        if (c != '\r' && c != ' ' && c != '\t') return saw_cr ? std::optional(LineEnd{'\r', false}) : std::nullopt;
        source.advance(1);
    }
    return std::nullopt;
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
        case PlyType::i64:
        case PlyType::u64:
        case PlyType::f64:
            break;
    }
    return 8;
}

bool is_ply_integer(PlyType type) { return type != PlyType::f32 && type != PlyType::f64; }

std::uint64_t fewest_element_bytes(const PlyElement& element, PlyFormat format) {
    if (format == PlyFormat::ascii) return 2 * element.properties.size();
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
        bytes += ply_type_size(property.is_list ? property.count_type : property.type);
    }
    return bytes;
}

bool is_ply(PlySource& source) { return read_first_line(source).has_value(); }

Result<PlyHeader> read_ply_header(PlySource& source) {
    const auto line_end = read_first_line(source);
    if (!line_end) return fail(ErrorKind::bad_input, "this is not a PLY file: it does not begin with a line \"ply\"");
    HeaderState state;
    state.header.line_end = line_end->last;
    std::vector<char> line;
    const std::uint64_t begin = source.consumed();
    while (!state.has_ended) {
        const std::uint64_t used = source.consumed() - begin;
        const auto next =
            used < most_ply_header_bytes
                ? read_line(source, line_end->last, line, most_ply_header_bytes - static_cast<std::size_t>(used))
                : std::nullopt;
        if (!next)
            return fail(ErrorKind::bad_input, "the PLY header has no end_header; the file is cut off or damaged");
        if (auto ok = read_header_line(state, *next); !ok) return tl::unexpected(ok.error());
    }
    if (line_end->cr_follows && source.ensure(1) && *source.cursor() == '\r') source.advance(1);
    if (!state.has_format) return fail(ErrorKind::bad_input, "the PLY header has no format line");
    return std::move(state.header);
}

}  // namespace htvm
