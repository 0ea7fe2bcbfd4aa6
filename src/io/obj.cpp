#include "io/obj.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "io/number_text.h"

namespace htvm {

namespace {

constexpr std::uint32_t none = 0xffffffff;

struct Corner {
    std::uint32_t position = none;
    std::uint32_t texcoord = none;
    std::uint32_t normal = none;
    bool operator==(const Corner&) const = default;
};

struct Polygon {
    std::size_t first_corner = 0;
    std::size_t corner_count = 0;
    std::size_t line = 0;
};

// The statements of the file, before corners become vertices.
struct ObjText {
    std::vector<Vector3f> positions;
    std::vector<Vector3f> colours;  // as long as positions, or empty; NaN if the line has none
    std::vector<Vector2f> texcoords;
    std::vector<Vector3f> normals;
    std::vector<Corner> corners;
    std::vector<Polygon> polygons;
    std::size_t foreign_line = 0;  // the first line that is not an OBJ statement; 0: none
    TextureReference texture;
    std::string material_name;      // of the faces that follow
    bool is_material_used = false;  // by a face so far
};

// Statements that do not describe a mesh and are skipped.
bool is_other_statement(std::string_view keyword) {
    constexpr std::array<std::string_view, 26> others = {
        "",       "g",      "o",   "s",    "mg",   "l",     "p",     "vp",      "usemap",
        "maplib", "cstype", "deg", "step", "curv", "curv2", "surf",  "parm",    "trim",
        "hole",   "scrv",   "sp",  "end",  "con",  "lod",   "bevel", "c_interp"};
    return std::find(others.begin(), others.end(), keyword) != others.end();
}

tl::unexpected<Error> bad_line(std::size_t line, const std::string& why) {
    return fail(ErrorKind::bad_input, "line " + std::to_string(line) + " of the OBJ: " + why);
}

// Removes the next word from the line and returns it; empty at its end.
std::string_view read_word(std::string_view& line) {
    const std::size_t begin = line.find_first_not_of(" \t\r\v\f");
    if (begin == line.npos) return line = {};
    const std::size_t end = std::min(line.find_first_of(" \t\r\v\f", begin), line.size());
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

// Parses the line's numbers, at most eight, into `values`. Returns how many, or nothing if one is not a number.
std::optional<std::size_t> read_numbers(std::string_view line, std::array<double, 8>& values) {
    std::size_t count = 0;
    for (std::string_view word = read_word(line); !word.empty() && count < values.size(); word = read_word(line)) {
        const auto value = parse_number(word);
        if (!value) return std::nullopt;
        values[count++] = *value;
    }
    return count;
}

Result<void> read_position(ObjText& obj, std::string_view line, std::size_t line_number, const MeshLimits& limits) {
    std::array<double, 8> values{};
    const auto count = read_numbers(line, values);
    if (!count || *count < 3) return bad_line(line_number, "v needs three numbers");
    if (auto ok = check_count(obj.positions.size() + 1, limits.most_vertices, "vertices or more"); !ok) return ok;
    if (!fits_float(values[0]) || !fits_float(values[1]) || !fits_float(values[2])) {
        return bad_line(line_number,
                        "the position of vertex " + std::to_string(obj.positions.size()) + " is not finite");
    }
    obj.positions.push_back(
        {static_cast<float>(values[0]), static_cast<float>(values[1]), static_cast<float>(values[2])});
    constexpr float missing = std::numeric_limits<float>::quiet_NaN();
    // Four numbers are x y z w, five have no known meaning, seven are x y z r g b a.
    if (*count >= 6) {
        obj.colours.resize(obj.positions.size() - 1, {missing, missing, missing});
        obj.colours.push_back({finite_or_zero(values[3]), finite_or_zero(values[4]), finite_or_zero(values[5])});
    } else if (!obj.colours.empty()) {
        obj.colours.push_back({missing, missing, missing});
    }
    return {};
}

// A corner's index, counted from 0. In the file, 1 is the first and -1 the last so far. Nothing if it is not such a
// number or points before the first. Whether it points past the last is known only at the end of the file.
std::optional<std::uint32_t> parse_index(std::string_view text, std::size_t count) {
    std::int64_t index = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, index);
    if (error != std::errc() || stop != end || index == 0) return std::nullopt;
    const std::int64_t from_zero = index > 0 ? index - 1 : static_cast<std::int64_t>(count) + index;
    if (from_zero < 0 || from_zero >= none) return std::nullopt;
    return static_cast<std::uint32_t>(from_zero);
}

std::optional<Corner> parse_corner(std::string_view word, const ObjText& obj) {
    std::array<std::string_view, 3> parts{};
    for (std::size_t p = 0; p < 3; ++p) {
        const std::size_t slash = std::min(word.find('/'), word.size());
        parts[p] = word.substr(0, slash);
        word.remove_prefix(std::min(slash + 1, word.size()));
    }
    Corner corner;
    const auto position = parse_index(parts[0], obj.positions.size());
    if (!position || !word.empty()) return std::nullopt;
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

Result<void> read_face(ObjText& obj, std::string_view line, std::size_t line_number, const MeshLimits& limits) {
    Polygon polygon{obj.corners.size(), 0, line_number};
    for (std::string_view word = read_word(line); !word.empty(); word = read_word(line)) {
        const auto corner = parse_corner(word, obj);
        if (!corner) {
            return bad_line(line_number, "the corner \"" + std::string(word.substr(0, 40)) + "\" of face " +
                                             std::to_string(obj.polygons.size()) +
                                             " cannot be read or refers to nothing");
        }
        obj.corners.push_back(*corner);
        ++polygon.corner_count;
    }
    if (auto ok = check_count(obj.corners.size(), 3 * limits.most_triangles, "corners or more"); !ok) return ok;
    obj.polygons.push_back(polygon);
    if (!std::exchange(obj.is_material_used, true)) {
        auto& parts = obj.texture.parts;
        if (std::ranges::find(parts, obj.material_name, &TextureReference::Part::material) == parts.end())
            parts.push_back({obj.material_name, {}, {}});
    }
    return {};
}

// What is left of the line: a name that may hold spaces.
std::string_view trimmed(std::string_view line) {
    constexpr const char* blanks = " \t\r\v\f";
    const std::size_t begin = line.find_first_not_of(blanks);
    if (begin == line.npos) return {};
    return line.substr(begin, line.find_last_not_of(blanks) + 1 - begin);
}

Result<void> read_statement(ObjText& obj, std::string_view line, std::size_t line_number, const MeshLimits& limits) {
    line = line.substr(0, line.find('#'));
    const std::string_view keyword = read_word(line);
    if (keyword == "v") return read_position(obj, line, line_number, limits);
    if (keyword == "f") return read_face(obj, line, line_number, limits);
    if (keyword == "mtllib") {
        obj.texture.material_files.emplace_back(trimmed(line));
        return {};
    }
    if (keyword == "usemtl") {
        obj.material_name = trimmed(line);
        obj.is_material_used = false;
        return {};
    }
    if (keyword != "vt" && keyword != "vn") {
        if (obj.foreign_line == 0 && !is_other_statement(keyword)) obj.foreign_line = line_number;
        return {};
    }
    std::array<double, 8> values{};
    const auto count = read_numbers(line, values);
    if (keyword == "vt") {
        if (!count || *count < 1) return bad_line(line_number, "vt needs two numbers");
        obj.texcoords.push_back({finite_or_zero(values[0]), finite_or_zero(values[1])});
        return check_count(obj.texcoords.size(), 3 * limits.most_triangles, "texture coordinates or more");
    }
    if (!count || *count < 3) return bad_line(line_number, "vn needs three numbers");
    obj.normals.push_back({finite_or_zero(values[0]), finite_or_zero(values[1]), finite_or_zero(values[2])});
    return check_count(obj.normals.size(), 3 * limits.most_triangles, "normals or more");
}

// Removes the next line from the text and returns it; lines continued with a backslash are put together in `joined`.
std::string_view read_line(std::string_view& text, std::size_t& line_number, std::string& joined) {
    joined.clear();
    for (;;) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        ++line_number;
        if (line.ends_with('\r')) line.remove_suffix(1);
        const bool continues = line.ends_with('\\') && !text.empty();
        if (continues) line.remove_suffix(1);
        if (joined.empty() && !continues) return line;
        joined += line;
        joined += ' ';
        if (!continues) return joined;
    }
}

Result<void> check_corners(const ObjText& obj) {
    for (std::size_t f = 0; f < obj.polygons.size(); ++f) {
        const Polygon& polygon = obj.polygons[f];
        for (std::size_t c = 0; c < polygon.corner_count; ++c) {
            const Corner& corner = obj.corners[polygon.first_corner + c];
            const bool position = corner.position < obj.positions.size();
            const bool texcoord = corner.texcoord == none || corner.texcoord < obj.texcoords.size();
            const bool normal = corner.normal == none || corner.normal < obj.normals.size();
            if (position && texcoord && normal) continue;
            return bad_line(polygon.line, "face " + std::to_string(f) + " refers to a " +
                                              (!position   ? "position"
                                               : !texcoord ? "texture coordinate"
                                                           : "normal") +
                                              " that the file does not have");
        }
    }
    return {};
}

// For each value, the index of the first that equals it. With these, equal values under several indices (many exporters
// write one per corner) do not split vertices.
template <std::size_t N>
std::vector<std::uint32_t> first_equal(const std::vector<std::array<float, N>>& values) {
    struct Hash {
        std::size_t operator()(const std::array<float, N>& value) const {
            std::uint64_t h = 0;
            for (const float c : value) h = (h ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0x9e3779b97f4a7c15u;
            return static_cast<std::size_t>(h ^ (h >> 32));
        }
    };
    std::unordered_map<std::array<float, N>, std::uint32_t, Hash> first;
    first.reserve(values.size());
    std::vector<std::uint32_t> out;
    out.reserve(values.size());
    for (const auto& value : values) {
        out.push_back(first.emplace(value, static_cast<std::uint32_t>(out.size())).first->second);
    }
    return out;
}

// True if every corner uses the attribute with the same index as its position, and the counts agree: then the attribute
// is one per position, also for positions that no corner uses.
bool in_step(const ObjText& obj, std::size_t count, std::uint32_t Corner::*attribute) {
    return count == obj.positions.size() && std::all_of(obj.corners.begin(), obj.corners.end(),
                                                        [&](const Corner& c) { return c.*attribute == c.position; });
}

// Assigns a vertex to every corner; `vertices` tells which combination each vertex is.
std::vector<std::uint32_t> vertices_of_corners(const ObjText& obj, std::vector<Corner>& vertices) {
    const auto texcoord_of = first_equal(obj.texcoords);
    const auto normal_of = first_equal(obj.normals);
    vertices.assign(obj.positions.size(), Corner{});
    std::vector<std::uint32_t> vertex_of_corner;
    vertex_of_corner.reserve(obj.corners.size());
    struct Hash {
        std::size_t operator()(const Corner& c) const {
            std::uint64_t h = c.position * 0x9e3779b97f4a7c15u;
            h = (h ^ (h >> 29) ^ c.texcoord) * 0xbf58476d1ce4e5b9u;
            h = (h ^ (h >> 32) ^ c.normal) * 0x94d049bb133111ebu;
            return static_cast<std::size_t>(h ^ (h >> 31));
        }
    };
    std::unordered_map<Corner, std::uint32_t, Hash> appended;
    for (Corner corner : obj.corners) {
        if (corner.texcoord != none) corner.texcoord = texcoord_of[corner.texcoord];
        if (corner.normal != none) corner.normal = normal_of[corner.normal];
        Corner& own = vertices[corner.position];
        if (own.position == none) own = corner;
        if (own == corner) {
            vertex_of_corner.push_back(corner.position);
            continue;
        }
        const auto [at, is_new] = appended.emplace(corner, static_cast<std::uint32_t>(vertices.size()));
        vertex_of_corner.push_back(at->second);
        if (is_new) vertices.push_back(corner);
    }
    return vertex_of_corner;
}

void give_colours(const ObjText& obj, const std::vector<Corner>& vertices, Mesh& mesh) {
    if (obj.colours.empty()) return;
    float largest = 0;
    for (const Vector3f& colour : obj.colours) {
        for (const float c : colour) largest = c > largest ? c : largest;
    }
    const float scale = largest > 1 ? 1.0f : 255.0f;
    for (const Corner& vertex : vertices) {
        Colour out{255, 255, 255};
        for (std::size_t i = 0; i < 3; ++i) {
            const float c = obj.colours[vertex.position][i] * scale;
            if (!std::isnan(c)) out[i] = static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0f, 255.0f)));
        }
        mesh.colours.push_back(out);
    }
}

Mesh mesh_of(const ObjText& obj) {
    Mesh mesh;
    std::vector<Corner> vertices;
    const auto vertex_of_corner = vertices_of_corners(obj, vertices);
    const bool texcoords_in_step = in_step(obj, obj.texcoords.size(), &Corner::texcoord);
    const bool normals_in_step = in_step(obj, obj.normals.size(), &Corner::normal);
    const auto uses = [&](std::uint32_t Corner::*attribute) {
        return std::any_of(obj.corners.begin(), obj.corners.end(),
                           [&](const Corner& c) { return c.*attribute != none; });
    };
    const bool has_texcoords = !obj.texcoords.empty() && (texcoords_in_step || uses(&Corner::texcoord));
    const bool has_normals = !obj.normals.empty() && (normals_in_step || uses(&Corner::normal));
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        Corner& vertex = vertices[v];
        if (vertex.position == none) {
            vertex.position = static_cast<std::uint32_t>(v);
            if (texcoords_in_step) vertex.texcoord = vertex.position;
            if (normals_in_step) vertex.normal = vertex.position;
        }
        mesh.positions.push_back(obj.positions[vertex.position]);
        if (has_texcoords)
            mesh.texcoords.push_back(vertex.texcoord == none ? Vector2f{} : obj.texcoords[vertex.texcoord]);
        if (has_normals) mesh.normals.push_back(vertex.normal == none ? Vector3f{} : obj.normals[vertex.normal]);
    }
    give_colours(obj, vertices, mesh);
    for (const Polygon& polygon : obj.polygons) {
        const std::uint32_t* corners = vertex_of_corner.data() + polygon.first_corner;
        for (std::size_t c = 2; c < polygon.corner_count; ++c) {
            mesh.triangles.push_back({corners[0], corners[c - 1], corners[c]});
        }
    }
    return mesh;
}

template <std::size_t N>
void append_statement(std::string& text, const char* keyword, const std::array<float, N>& values) {
    text += keyword;
    for (const float value : values) {
        text += ' ';
        append_number(text, value);
    }
}

}  // namespace

Result<Mesh> read_obj(std::string_view text, const MeshReadOptions& options, MeshFindings* findings) {
    const auto& limits = options.limits;
    ObjText obj;
    std::string joined;
    std::size_t line_number = 0;
    while (!text.empty()) {
        const std::size_t first_line = line_number + 1;
        const std::string_view line = read_line(text, line_number, joined);
        if (auto ok = read_statement(obj, line, first_line, limits); !ok) return tl::unexpected(ok.error());
    }
    if (obj.positions.empty() && obj.foreign_line > 0)
        return bad_line(obj.foreign_line,
                        "it is not an OBJ statement, and there is no vertex: this is another kind of file");
    if (auto ok = check_corners(obj); !ok) return tl::unexpected(ok.error());
    if (findings) findings->texture = std::move(obj.texture);
    return mesh_of(obj);
}

std::string write_obj_material(std::string_view image) {
    return "newmtl texture\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nmap_Kd " + std::string(image) + '\n';
}

Result<std::string> write_obj(const Mesh& mesh, std::string_view material_file) {
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    std::string text;
    if (!material_file.empty()) text.append("mtllib ").append(material_file).append("\n");
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        append_statement(text, "v", mesh.positions[v]);
        if (!mesh.colours.empty()) {
            for (const std::uint8_t c : mesh.colours[v]) {
                text += ' ';
                // Six digits distinguish 256 levels and stay legible.
                append_number(text, static_cast<float>(std::round(c / 255.0 * 1e6) / 1e6));
            }
        }
        text += '\n';
    }
    for (const Vector2f& texcoord : mesh.texcoords) append_statement(text, "vt", texcoord), text += '\n';
    for (const Vector3f& normal : mesh.normals) append_statement(text, "vn", normal), text += '\n';
    if (!material_file.empty()) text += "usemtl texture\n";
    for (const Triangle& triangle : mesh.triangles) {
        text += 'f';
        for (const std::uint32_t index : triangle) {
            const std::string number = std::to_string(std::uint64_t{index} + 1);
            text += ' ' + number;
            if (!mesh.texcoords.empty()) text += '/' + number;
            if (!mesh.normals.empty()) text += (mesh.texcoords.empty() ? "//" : "/") + number;
        }
        text += '\n';
    }
    return text;
}

}  // namespace htvm
