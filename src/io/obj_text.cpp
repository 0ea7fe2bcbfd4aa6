#include "io/obj_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>

#include "io/mesh_check.h"
#include "io/number_text.h"
#include "io/obj_line.h"

namespace htvm {

namespace {

// What is known while statements are read.
struct Reading {
    const MeshReadOptions& options;
    MeshFindings& findings;
    ObjText obj = {};
    std::size_t line = 0;          // the number of the statement's first line
    std::size_t foreign_line = 0;  // the first line that is not an OBJ statement; 0: none
    std::uint64_t triangles = 0;
    std::string material = {};   // of the faces that follow
    bool is_part_known = false;  // `part` is that of the material
    std::uint16_t part = 0;
    std::unordered_map<std::string, std::uint16_t> part_of_material = {};
    bool names_no_texcoord = false, names_no_normal = false;  // a corner has an index that there is not
};

// Statements that do not describe a mesh and are skipped.
bool is_other_statement(std::string_view keyword) {
    constexpr std::array<std::string_view, 26> others = {
        "",       "g",      "o",   "s",    "mg",   "l",     "p",     "vp",      "usemap",
        "maplib", "cstype", "deg", "step", "curv", "curv2", "surf",  "parm",    "trim",
        "hole",   "scrv",   "sp",  "end",  "con",  "lod",   "bevel", "c_interp"};
    return keyword.starts_with('#') || std::find(others.begin(), others.end(), keyword) != others.end();
}

tl::unexpected<Error> bad_line(std::size_t line, const std::string& why) {
    return fail(ErrorKind::bad_input, "line " + std::to_string(line) + " of the OBJ: " + why);
}

// A line of numbers without its comment. The '#' of 1.#INF and its like begins none.
std::string_view without_comment(std::string_view line) {
    for (std::size_t at = line.find('#'); at != line.npos; at = line.find('#', at + 1)) {
        if (at == 0 || line[at - 1] != '.') return line.substr(0, at);
    }
    return line;
}

// Parses the line's numbers, at most eight, into `values`. Returns how many, or nothing if one is not a number.
std::optional<std::size_t> read_numbers(std::string_view line, std::array<double, 8>& values) {
    std::size_t count = 0;
    for (std::string_view word = read_word(line); !word.empty() && count < values.size(); word = read_word(line)) {
        const auto value = parse_measurement(word);
        if (!value) return std::nullopt;
        values[count++] = *value;
    }
    return count;
}

constexpr float missing = std::numeric_limits<float>::quiet_NaN();

Result<void> read_position(Reading& reading, std::string_view line) {
    auto& [positions, colours, texcoords, normals, corners, polygons, texture] = reading.obj;
    std::array<double, 8> values{};
    const auto count = read_numbers(line, values);
    if (!count || *count < 3) return bad_line(reading.line, "v needs three numbers");
    if (auto ok = check_count(positions.size() + 1, reading.options.limits.most_vertices, "vertices or more"); !ok)
        return ok;
    Vector3f position{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double value = values[axis] - reading.options.origin[axis];
        position[axis] = fits_float(value) ? static_cast<float>(value) : missing;
    }
    positions.push_back(position);
    // Four numbers are x y z w, five have no known meaning, seven are x y z r g b a.
    if (*count == 4 && values[3] != 1)
        remark(&reading.findings, "weights",
               "its positions have a fourth number, the weight in curves, which is unused");
    if (*count >= 6) {
        colours.resize(positions.size() - 1, {missing, missing, missing});
        colours.push_back({finite_or_zero(values[3]), finite_or_zero(values[4]), finite_or_zero(values[5])});
    } else if (!colours.empty()) {
        colours.push_back({missing, missing, missing});
    }
    return {};
}

// An index that refers to nothing, as no_index is none.
constexpr std::uint32_t bad_index = no_index - 1;

// A corner's index, counted from 0. In the file, 1 is the first and -1 the last so far. bad_index if it points before
// the first or has no place in 32 bits; nothing if it is no whole number. Whether it points past the last is known only
// at the end of the file.
std::optional<std::uint32_t> parse_index(std::string_view text, std::size_t count) {
    std::int64_t index = 0;
    const char* end = text.data() + text.size();
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [stop, error] = std::from_chars(text.data(), end, index);
    if (error == std::errc::result_out_of_range && stop == end) return bad_index;
    if (error != std::errc() || stop != end) return std::nullopt;
    if (index == 0) return bad_index;
    const std::int64_t from_zero = index > 0 ? index - 1 : static_cast<std::int64_t>(count) + index;
    if (from_zero < 0 || from_zero >= bad_index) return bad_index;
    return static_cast<std::uint32_t>(from_zero);
}

// Indices of texture coordinates and normals that refer to nothing stay bad_index.
std::optional<ObjCorner> parse_corner(std::string_view word, const ObjText& obj) {
    std::array<std::string_view, 3> parts{};
    for (std::size_t p = 0; p < 3; ++p) {
        const std::size_t slash = std::min(word.find('/'), word.size());
        parts[p] = word.substr(0, slash);
        word.remove_prefix(std::min(slash + 1, word.size()));
    }
    ObjCorner corner;
    const auto position = parse_index(parts[0], obj.positions.size());
    if (!position || *position == bad_index || !word.empty()) return std::nullopt;
    corner.position = *position;
    if (!parts[1].empty()) {
        const auto texcoord = parse_index(parts[1], obj.texcoords.size());
        if (!texcoord) return std::nullopt;
        corner.texcoord = *texcoord;
    }
    if (!parts[2].empty()) {
        const auto normal = parse_index(parts[2], obj.normals.size());
        if (!normal) return std::nullopt;
        corner.normal = *normal;
    }
    return corner;
}

// The part of the texture that the material's faces are, in the order of their first use.
Result<std::uint16_t> part_of_faces(Reading& reading) {
    if (reading.is_part_known) return reading.part;
    auto& parts = reading.obj.texture.parts;
    const auto known = reading.part_of_material.find(reading.material);
    if (known != reading.part_of_material.end()) {
        reading.part = known->second;
    } else {
        constexpr std::size_t most = std::numeric_limits<std::uint16_t>::max();
        if (parts.size() == most)
            return fail(ErrorKind::limit, "line " + std::to_string(reading.line) +
                                              " of the OBJ: its faces use more than " + std::to_string(most) +
                                              " materials");
        reading.part = static_cast<std::uint16_t>(parts.size());
        reading.part_of_material.emplace(reading.material, reading.part);
        parts.push_back({reading.material, {}, {}});
    }
    reading.is_part_known = true;
    return reading.part;
}

Result<void> read_face(Reading& reading, std::string_view line) {
    auto& obj = reading.obj;
    const auto& limits = reading.options.limits;
    ObjPolygon polygon{obj.corners.size(), 0, reading.line, 0};
    for (std::string_view word = read_word(line); !word.empty(); word = read_word(line)) {
        const auto corner = parse_corner(word, obj);
        if (!corner) {
            return bad_line(reading.line, "the corner \"" + std::string(word.substr(0, 40)) + "\" of face " +
                                              std::to_string(obj.polygons.size()) +
                                              " cannot be read or refers to nothing");
        }
        obj.corners.push_back(*corner);
        ++polygon.corner_count;
    }
    if (polygon.corner_count < 3) {
        obj.corners.resize(polygon.first_corner);
        return {};
    }
    reading.triangles += polygon.corner_count - 2;
    if (auto ok = check_count(reading.triangles, limits.most_triangles, "triangles or more"); !ok) return ok;
    const auto part = part_of_faces(reading);
    if (!part) return tl::unexpected(part.error());
    polygon.part = *part;
    obj.polygons.push_back(polygon);
    return {};
}

Result<void> read_texcoord(Reading& reading, std::string_view line) {
    std::array<double, 8> values{};
    const auto count = read_numbers(line, values);
    if (!count || *count < 1) return bad_line(reading.line, "vt needs two numbers");
    auto& texcoords = reading.obj.texcoords;
    texcoords.push_back({finite_or_zero(values[0]), finite_or_zero(values[1])});
    return check_count(texcoords.size(), 3 * reading.options.limits.most_triangles, "texture coordinates or more");
}

Result<void> read_normal(Reading& reading, std::string_view line) {
    std::array<double, 8> values{};
    const auto count = read_numbers(line, values);
    if (!count || *count < 3) return bad_line(reading.line, "vn needs three numbers");
    auto& normals = reading.obj.normals;
    normals.push_back({finite_or_zero(values[0]), finite_or_zero(values[1]), finite_or_zero(values[2])});
    return check_count(normals.size(), 3 * reading.options.limits.most_triangles, "normals or more");
}

Result<void> read_statement(Reading& reading, std::string_view line) {
    std::string_view rest = line;
    const std::string_view keyword = read_word(rest);
    // Names may hold a '#', so these lines have no comments.
    if (keyword == "mtllib") {
        if (const auto names = trimmed(rest); !names.empty()) reading.obj.texture.material_files.emplace_back(names);
        return {};
    }
    if (keyword == "usemtl") {
        reading.material = trimmed(rest);
        reading.is_part_known = false;
        return {};
    }
    rest = without_comment(rest);
    if (keyword == "v") return read_position(reading, rest);
    if (keyword == "vt") return read_texcoord(reading, rest);
    if (keyword == "vn") return read_normal(reading, rest);
    if (keyword == "f" || keyword == "fo") return read_face(reading, rest);
    if (reading.foreign_line == 0 && !is_other_statement(keyword)) reading.foreign_line = reading.line;
    return {};
}

// Fails if a corner refers to no position; takes off the references to other things that there are none of.
Result<void> check_corners(Reading& reading) {
    auto& obj = reading.obj;
    for (std::size_t f = 0; f < obj.polygons.size(); ++f) {
        const ObjPolygon& polygon = obj.polygons[f];
        for (std::size_t c = 0; c < polygon.corner_count; ++c) {
            ObjCorner& corner = obj.corners[polygon.first_corner + c];
            if (corner.position >= obj.positions.size()) {
                return bad_line(polygon.line,
                                "face " + std::to_string(f) + " refers to a position that the file does not have");
            }
            if (corner.texcoord != no_index && corner.texcoord >= obj.texcoords.size()) {
                corner.texcoord = no_index;
                reading.names_no_texcoord = true;
            }
            if (corner.normal != no_index && corner.normal >= obj.normals.size()) {
                corner.normal = no_index;
                reading.names_no_normal = true;
            }
        }
    }
    return {};
}

void remark_on_references(const Reading& reading) {
    const auto tell = [&](bool is_wrong, bool there_are_none, const char* about, const std::string& what) {
        if (!is_wrong) return;
        if (there_are_none) {
            remark(&reading.findings, about, "its faces name " + what + ", of which it has none");
        } else {
            remark(&reading.findings, about, "some of its faces name " + what + " that it does not have: 0 is taken",
                   true);
        }
    };
    tell(reading.names_no_texcoord, reading.obj.texcoords.empty(), "missing-texcoords", "texture coordinates");
    tell(reading.names_no_normal, reading.obj.normals.empty(), "missing-normals", "normals");
}

}  // namespace

Result<ObjText> read_obj_text(std::string_view text, const MeshReadOptions& options, MeshFindings& findings) {
    Reading reading{.options = options, .findings = findings};
    if (constexpr std::string_view mark = "\xef\xbb\xbf"; text.starts_with(mark)) text.remove_prefix(mark.size());
    std::string joined;
    std::size_t line_number = 0;
    while (!text.empty()) {
        reading.line = line_number + 1;
        const std::string_view line = read_line(text, line_number, joined);
        if (auto ok = read_statement(reading, line); !ok) return tl::unexpected(ok.error());
    }
    if (reading.obj.positions.empty() && reading.foreign_line > 0)
        return bad_line(reading.foreign_line,
                        "it is not an OBJ statement, and there is no vertex: this is another kind of file");
    if (auto ok = check_corners(reading); !ok) return tl::unexpected(ok.error());
    remark_on_references(reading);
    return std::move(reading.obj);
}

}  // namespace htvm
