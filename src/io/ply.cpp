#include "io/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <istream>
#include <limits>
#include <string>
#include <utility>

#include "io/number_text.h"
#include "io/ply_header.h"
#include "io/ply_source.h"

namespace htvm {

namespace {

// The meaning of a vertex property, and the index of its value in VertexValues.
enum Field { x, y, z, nx, ny, nz, s, t, red, green, blue, field_count, ignored };
using VertexValues = std::array<double, field_count>;

struct Body {
    PlySource& source;
    PlyFormat format;
    MeshLimits limits;
    std::uint64_t vertex_count = 0;  // as claimed by the header
    bool took_words = false;         // words of the text body were taken, so the rest of the last line must be skipped
};

template <std::size_t size>
std::uint64_t load(const std::uint8_t* bytes, bool big_endian) {
    std::uint64_t bits = 0;
    if (big_endian) {
        for (std::size_t i = 0; i < size; ++i) bits |= static_cast<std::uint64_t>(bytes[i]) << (8 * (size - 1 - i));
    } else {
        for (std::size_t i = 0; i < size; ++i) bits |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    }
    return bits;
}

double decode_value(const std::uint8_t* bytes, PlyType type, bool big_endian) {
    switch (type) {
        case PlyType::i8:
            return static_cast<std::int8_t>(*bytes);
        case PlyType::u8:
            return *bytes;
        case PlyType::i16:
            return static_cast<std::int16_t>(load<2>(bytes, big_endian));
        case PlyType::u16:
            return static_cast<std::uint16_t>(load<2>(bytes, big_endian));
        case PlyType::i32:
            return static_cast<std::int32_t>(load<4>(bytes, big_endian));
        case PlyType::u32:
            return static_cast<std::uint32_t>(load<4>(bytes, big_endian));
        case PlyType::f32:
            return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(load<4>(bytes, big_endian))));
        case PlyType::f64:
            break;
    }
    return std::bit_cast<double>(load<8>(bytes, big_endian));
}

// The next value; nothing if the bytes end or, in text, if the next word is not a number.
std::optional<double> read_value(Body& body, PlyType type) {
    if (body.format == PlyFormat::ascii) {
        std::array<char, 256> word;
        body.took_words = true;
        return parse_number(read_word(body.source, word));
    }
    const std::size_t size = ply_type_size(type);
    if (!body.source.ensure(size)) return std::nullopt;
    const double value = decode_value(body.source.cursor(), type, body.format == PlyFormat::binary_big_endian);
    body.source.advance(size);
    return value;
}

// The length of a list; nothing if it is missing, negative or malformed.
std::optional<std::uint64_t> read_list_length(Body& body, const PlyProperty& list) {
    const auto length = read_value(body, list.count_type);
    if (!length || !(*length >= 0) || *length > 4294967295.0) return std::nullopt;
    const auto whole = static_cast<std::uint64_t>(*length);
    if (static_cast<double>(whole) != *length) return std::nullopt;
    return whole;
}

bool skip_property(Body& body, const PlyProperty& property) {
    std::uint64_t count = 1;
    if (property.is_list) {
        const auto length = read_list_length(body, property);
        if (!length) return false;
        count = *length;
    }
    if (body.format != PlyFormat::ascii) return body.source.skip(count * ply_type_size(property.type));
    for (std::uint64_t i = 0; i < count; ++i) {
        if (!read_value(body, property.type)) return false;
    }
    return true;
}

// Makes a stream fetch data in pieces rather than value by value, but never more than the least that the remaining
// elements take.
void fetch_ahead(Body& body, std::uint64_t element_bytes, std::uint64_t elements_left) {
    constexpr std::uint64_t piece = 1 << 16;
    if (body.source.buffered() >= element_bytes) return;
    // In text, the last value of all may lack the separator that the count includes.
    const std::uint64_t wanted = element_bytes * std::min(elements_left, piece / (element_bytes + 1) + 1);
    (void)body.source.ensure(static_cast<std::size_t>(std::min(wanted - (wanted > 0 ? 1 : 0), piece)));
}

std::string text_of(const char* element, std::uint64_t i, std::uint64_t count) {
    return std::string(element) + " " + std::to_string(i) + " of " + std::to_string(count);
}

tl::unexpected<Error> ends_within(const std::string& where) {
    return fail(ErrorKind::bad_input,
                "the PLY ends or cannot be read at " + where + "; the file is cut off or damaged");
}

// Fails if the element claims more than the available bytes can hold.
Result<void> check_element_count(const Body& body, const PlyElement& element) {
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    const auto left = body.source.remaining();
    if (!left || fewest == 0) return {};
    const std::uint64_t slack = body.format == PlyFormat::ascii ? 1 : 0;
    if (element.count <= (*left + slack) / fewest) return {};
    return fail(ErrorKind::bad_input, "the PLY header claims " + std::to_string(element.count) + " of the element \"" +
                                          element.name.substr(0, 80) + "\", more than the " + std::to_string(*left) +
                                          " bytes that follow can hold; the file is cut off or damaged");
}

// How much to reserve for a count that was checked against the available bytes, or (for a stream) was not.
std::size_t reservation(const Body& body, std::uint64_t count, std::uint64_t bytes_each) {
    const std::uint64_t most = body.source.remaining().value_or(1 << 18) / bytes_each;
    return static_cast<std::size_t>(std::min(count, most));
}

// How the properties of a vertex element form a vertex.
struct VertexLayout {
    std::vector<Field> fields;  // of each property
    std::array<PlyType, field_count> type{};
    std::array<std::size_t, field_count> offset{};  // in the vertex's bytes, in a binary file, where it has no lists
    bool lists = false;
    bool normals = false;
    bool texcoords = false;
    bool colours = false;
};

Field field_named(std::string_view name) {
    static constexpr std::array<std::pair<std::string_view, Field>, 21> names{{
        {"x", x},
        {"y", y},
        {"z", z},
        {"nx", nx},
        {"ny", ny},
        {"nz", nz},
        {"s", s},
        {"t", t},
        {"u", s},
        {"v", t},
        {"texture_u", s},
        {"texture_v", t},
        {"red", red},
        {"green", green},
        {"blue", blue},
        {"diffuse_red", red},
        {"diffuse_green", green},
        {"diffuse_blue", blue},
        {"r", red},
        {"g", green},
        {"b", blue},
    }};
    for (const auto& [known, field] : names) {
        if (known == name) return field;
    }
    return ignored;
}

Result<VertexLayout> layout_of(const PlyElement& vertex) {
    VertexLayout layout;
    std::array<bool, field_count> seen{};
    std::size_t offset = 0;
    for (const PlyProperty& property : vertex.properties) {
        Field field = property.is_list ? ignored : field_named(property.name);
        if (field != ignored && seen[field]) {
            if (field <= z) {
                return fail(ErrorKind::bad_input, "the PLY header declares the vertex's " + property.name + " twice");
            }
            field = ignored;  // of properties with the same meaning, such as s t and u v, the first counts
        }
        if (field != ignored) {
            seen[field] = true;
            layout.type[field] = property.type;
            layout.offset[field] = offset;
        }
        layout.fields.push_back(field);
        layout.lists = layout.lists || property.is_list;
        offset += ply_type_size(property.type);
    }
    if (vertex.count > 0 && !(seen[x] && seen[y] && seen[z])) {
        return fail(ErrorKind::bad_input, "the PLY header declares no x, y, z for the element \"vertex\"");
    }
    layout.normals = seen[nx] && seen[ny] && seen[nz];
    layout.texcoords = seen[s] && seen[t];
    layout.colours = seen[red] && seen[green] && seen[blue];
    return layout;
}

// Converts a colour component of the property's type to 0..255.
std::uint8_t colour_component(double value, PlyType type) {
    if (type == PlyType::f32 || type == PlyType::f64) value *= 255;
    if (type == PlyType::u16) value /= 257;
    if (!(value > 0)) return 0;  // includes NaN
    return static_cast<std::uint8_t>(std::lround(std::min(value, 255.0)));
}

// False if the bytes end or cannot be read.
bool read_vertex(Body& body, const PlyElement& element, const VertexLayout& layout, VertexValues& value) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (layout.fields[p] == ignored) {
            if (!skip_property(body, property)) return false;
            continue;
        }
        const auto taken = read_value(body, property.type);
        if (!taken) return false;
        value[layout.fields[p]] = *taken;
    }
    return true;
}

void append_vertex(Mesh& mesh, const VertexLayout& layout, const VertexValues& value) {
    mesh.positions.push_back(
        {static_cast<float>(value[x]), static_cast<float>(value[y]), static_cast<float>(value[z])});
    if (layout.normals) {
        mesh.normals.push_back({finite_or_zero(value[nx]), finite_or_zero(value[ny]), finite_or_zero(value[nz])});
    }
    if (layout.texcoords) mesh.texcoords.push_back({finite_or_zero(value[s]), finite_or_zero(value[t])});
    if (layout.colours) {
        mesh.colours.push_back({colour_component(value[red], layout.type[red]),
                                colour_component(value[green], layout.type[green]),
                                colour_component(value[blue], layout.type[blue])});
    }
}

tl::unexpected<Error> bad_position(std::uint64_t v) {
    return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(v) + " is not finite");
}

// Where vertices lie that all take the same number of bytes: those of a binary file, without lists.
struct VertexBlock {
    const std::uint8_t* bytes = nullptr;
    std::size_t vertices = 0, stride = 0;
    bool big_endian = false;
};

// One property of all vertices as component c of the last elements of `out`; `otherwise` where it is no finite float.
template <std::size_t size>
void copy_floats(const VertexBlock& block, std::size_t offset, PlyType type, float otherwise, std::size_t c,
                 std::vector<std::array<float, size>>& out) {
    auto* to = out.data() + (out.size() - block.vertices);
    const auto* from = block.bytes + offset;
    const bool plain = type == PlyType::f32 && !block.big_endian;
    for (std::size_t v = 0; v < block.vertices; ++v, from += block.stride) {
        if (plain) {
            const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(load<4>(from, false)));
            to[v][c] = std::abs(value) <= std::numeric_limits<float>::max() ? value : otherwise;
            continue;
        }
        const double value = decode_value(from, type, block.big_endian);
        to[v][c] = fits_float(value) ? static_cast<float>(value) : otherwise;
    }
}

// Appends a block's vertices, property by property. Fails if a position is not finite.
Result<void> append_block(Mesh& mesh, const VertexLayout& layout, const VertexBlock& block) {
    const std::size_t before = mesh.positions.size(), after = before + block.vertices;
    mesh.positions.resize(after);
    for (std::size_t c = 0; c < 3; ++c) {
        constexpr float none = std::numeric_limits<float>::quiet_NaN();
        copy_floats(block, layout.offset[x + c], layout.type[x + c], none, c, mesh.positions);
    }
    for (std::size_t v = before; v < after; ++v) {
        const auto& p = mesh.positions[v];
        if (std::isnan(p[0]) || std::isnan(p[1]) || std::isnan(p[2])) return bad_position(v);
    }
    if (layout.normals) {
        mesh.normals.resize(after);
        for (std::size_t c = 0; c < 3; ++c)
            copy_floats(block, layout.offset[nx + c], layout.type[nx + c], 0, c, mesh.normals);
    }
    if (layout.texcoords) {
        mesh.texcoords.resize(after);
        for (std::size_t c = 0; c < 2; ++c)
            copy_floats(block, layout.offset[s + c], layout.type[s + c], 0, c, mesh.texcoords);
    }
    if (!layout.colours) return {};
    mesh.colours.resize(after);
    for (std::size_t c = 0; c < 3; ++c) {
        const auto type = layout.type[red + c];
        const auto* from = block.bytes + layout.offset[red + c];
        for (std::size_t v = before; v < after; ++v, from += block.stride)
            mesh.colours[v][c] =
                type == PlyType::u8 ? *from : colour_component(decode_value(from, type, block.big_endian), type);
    }
    return {};
}

// Reads vertices of `stride` bytes each, many at a time, in a tenth of the time that one value after another takes.
Result<void> read_vertex_blocks(Body& body, const PlyElement& element, const VertexLayout& layout, std::size_t stride,
                                Mesh& mesh) {
    constexpr std::size_t piece = 1 << 16;
    VertexBlock block;
    block.stride = stride;
    block.big_endian = body.format == PlyFormat::binary_big_endian;
    for (std::uint64_t v = 0; v < element.count; v += block.vertices) {
        const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(element.count - v, piece / stride));
        const bool ended = !body.source.ensure(wanted * stride);
        block.vertices = ended ? body.source.buffered() / stride : wanted;
        block.bytes = body.source.cursor();
        if (auto fine = append_block(mesh, layout, block); !fine) return fine;
        if (ended) return ends_within(text_of("vertex", v + block.vertices, element.count));
        body.source.advance(block.vertices * stride);
    }
    return {};
}

Result<void> read_vertices(Body& body, const PlyElement& element, Mesh& mesh) {
    const auto layout = layout_of(element);
    if (!layout) return tl::unexpected(layout.error());
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    const std::size_t reserved = reservation(body, element.count, std::max<std::uint64_t>(fewest, 1));
    mesh.positions.reserve(reserved);
    if (layout->normals) mesh.normals.reserve(reserved);
    if (layout->texcoords) mesh.texcoords.reserve(reserved);
    if (layout->colours) mesh.colours.reserve(reserved);
    constexpr std::uint64_t most_in_blocks = 4096;  // bytes of a vertex: of more properties hardly any is of use
    if (body.format != PlyFormat::ascii && !layout->lists && fewest <= most_in_blocks && element.count > 0)
        return read_vertex_blocks(body, element, *layout, static_cast<std::size_t>(fewest), mesh);
    VertexValues value{};
    for (std::uint64_t v = 0; v < element.count; ++v) {
        fetch_ahead(body, fewest, element.count - v);
        if (!read_vertex(body, element, *layout, value)) return ends_within(text_of("vertex", v, element.count));
        if (!fits_float(value[x]) || !fits_float(value[y]) || !fits_float(value[z])) return bad_position(v);
        append_vertex(mesh, *layout, value);
    }
    return {};
}

tl::unexpected<Error> bad_index(std::uint64_t face, std::uint64_t vertex_count) {
    return fail(ErrorKind::bad_input, "face " + std::to_string(face) + " uses a vertex index that is not one of 0 to " +
                                          std::to_string(vertex_count) + " - 1");
}

// A vertex index as a whole number below vertex_count; nothing if it is not one.
std::optional<std::uint32_t> as_index(double value, std::uint64_t vertex_count) {
    if (!(value >= 0 && value < static_cast<double>(vertex_count))) return std::nullopt;
    const auto index = static_cast<std::uint32_t>(value);
    if (static_cast<double>(index) != value) return std::nullopt;
    return index;
}

Result<void> read_polygon(Body& body, const PlyProperty& list, std::uint64_t face, std::uint64_t faces, Mesh& mesh) {
    const auto corners = read_list_length(body, list);
    if (!corners) return ends_within(text_of("face", face, faces));
    Triangle triangle{};
    for (std::uint64_t c = 0; c < *corners; ++c) {
        const auto value = read_value(body, list.type);
        if (!value) return ends_within(text_of("face", face, faces));
        const auto index = as_index(*value, body.vertex_count);
        if (!index) return bad_index(face, body.vertex_count);
        if (c == 0) triangle[0] = *index;
        if (c > 0) triangle[1] = std::exchange(triangle[2], *index);
        if (c < 2) continue;
        if (mesh.triangles.size() >= body.limits.most_triangles) {
            return check_count(body.limits.most_triangles + 1, body.limits.most_triangles, "triangles or more");
        }
        mesh.triangles.push_back(triangle);
    }
    return {};
}

// Takes the usual faces, only a triangle each with 32-bit indices, in a fraction of the time: some of those that
// follow. Returns how many, none if the next face is of another kind, which read_polygon handles.
std::uint64_t read_plain_triangles(Body& body, const PlyElement& element, std::uint64_t faces, Mesh& mesh) {
    constexpr std::size_t bytes = 1 + 3 * 4;
    constexpr std::uint64_t at_once = 256;  // few, as room for those that are not taken is made again and again
    const PlyProperty& list = element.properties[0];
    const bool plain = body.format == PlyFormat::binary_little_endian && element.properties.size() == 1 &&
                       ply_type_size(list.count_type) == 1 && (list.type == PlyType::u32 || list.type == PlyType::i32);
    const std::size_t before = mesh.triangles.size();
    if (!plain || before >= body.limits.most_triangles) return 0;
    if (!body.source.ensure(1) || *body.source.cursor() != 3 || !body.source.ensure(bytes)) return 0;
    const std::uint64_t most = std::min(body.vertex_count, std::uint64_t{1} << 31);  // an int32 above would be negative
    const auto at_hand = static_cast<std::size_t>(
        std::min<std::uint64_t>({faces, at_once, body.source.buffered() / bytes, body.limits.most_triangles - before}));
    mesh.triangles.resize(before + at_hand);
    const std::uint8_t* face = body.source.cursor();
    std::size_t taken = 0;
    for (; taken < at_hand && *face == 3; ++taken, face += bytes) {
        Triangle triangle{};
        for (std::size_t c = 0; c < 3; ++c) triangle[c] = static_cast<std::uint32_t>(load<4>(face + 1 + 4 * c, false));
        if (triangle[0] >= most || triangle[1] >= most || triangle[2] >= most) break;
        mesh.triangles[before + taken] = triangle;
    }
    mesh.triangles.resize(before + taken);
    body.source.advance(taken * bytes);
    return taken;
}

Result<void> read_faces(Body& body, const PlyElement& element, Mesh& mesh) {
    std::size_t indices = element.properties.size();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index")) indices = p;
    }
    if (indices == element.properties.size() && element.count > 0) {
        return fail(ErrorKind::bad_input, "the PLY header declares no list vertex_indices for the element \"face\"");
    }
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    mesh.triangles.reserve(reservation(body, element.count, fewest + 3));
    for (std::uint64_t f = 0; f < element.count; ++f) {
        fetch_ahead(body, fewest, element.count - f);
        if (const auto taken = indices == 0 ? read_plain_triangles(body, element, element.count - f, mesh) : 0) {
            f += taken - 1;
            continue;
        }
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            if (p == indices) {
                if (auto ok = read_polygon(body, element.properties[p], f, element.count, mesh); !ok) return ok;
            } else if (!skip_property(body, element.properties[p])) {
                return ends_within(text_of("face", f, element.count));
            }
        }
    }
    return {};
}

Result<void> skip_element(Body& body, const PlyElement& element) {
    if (element.properties.empty()) return {};
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    for (std::uint64_t i = 0; i < element.count; ++i) {
        fetch_ahead(body, fewest, element.count - i);
        for (const PlyProperty& property : element.properties) {
            if (!skip_property(body, property)) return ends_within(text_of(element.name.c_str(), i, element.count));
        }
    }
    return {};
}

Result<PlyHeader> read_header(PlySource& source) {
    std::vector<char> line;
    const std::uint64_t begin = source.consumed();
    const auto magic = read_line(source, line, 16);
    if (!magic || (*magic != "ply" && *magic != "PLY")) {
        return fail(ErrorKind::bad_input, "this is not a PLY file: it does not begin with a line \"ply\"");
    }
    PlyHeader header;
    bool has_format = false;
    for (;;) {
        const std::uint64_t used = source.consumed() - begin;
        const auto next = used < most_ply_header_bytes
                              ? read_line(source, line, most_ply_header_bytes - static_cast<std::size_t>(used))
                              : std::nullopt;
        if (!next)
            return fail(ErrorKind::bad_input, "the PLY header has no end_header; the file is cut off or damaged");
        has_format = has_format || next->starts_with("format");
        const auto ended = read_ply_header_line(header, *next);
        if (!ended) return tl::unexpected(ended.error());
        if (*ended) break;
    }
    if (!has_format) return fail(ErrorKind::bad_input, "the PLY header has no format line");
    return header;
}

Result<PlyAtStart> read_one(PlySource& source, const MeshReadOptions& options) {
    const auto header = read_header(source);
    if (!header) return tl::unexpected(header.error());
    const MeshLimits& limits = options.limits;
    Body body{source, header->format, limits};
    bool has_vertices = false;
    for (const PlyElement& element : header->elements) {
        if (element.name == "tristrips") {
            return fail(ErrorKind::unsupported,
                        "the PLY holds triangle strips, which are not read; write it with faces");
        }
        if (element.name != "vertex") continue;
        has_vertices = true;
        body.vertex_count = element.count;
        const std::uint64_t most =
            std::min<std::uint64_t>(limits.most_vertices, std::numeric_limits<std::uint32_t>::max());
        if (auto ok = check_count(element.count, most, "vertices"); !ok) return tl::unexpected(ok.error());
    }
    if (!has_vertices) return fail(ErrorKind::bad_input, "the PLY header declares no element \"vertex\"");
    Mesh mesh;
    for (const PlyElement& element : header->elements) {
        Result<void> read = check_element_count(body, element);
        if (!read) return tl::unexpected(read.error());
        if (element.name == "vertex") {
            read = read_vertices(body, element, mesh);
        } else if (element.name == "face") {
            read = read_faces(body, element, mesh);
        } else {
            read = skip_element(body, element);
        }
        if (!read) return tl::unexpected(read.error());
    }
    if (body.took_words) {  // skip the rest of the last line, so that what follows begins on its own line
        while (source.ensure(1)) {
            const std::uint8_t c = *source.cursor();
            source.advance(1);
            if (c == '\n') break;
        }
    }
    MeshFindings findings;
    if (!header->texture.empty())
        findings.texture.parts.push_back({{}, add_image(findings.texture, header->texture), {}});
    return PlyAtStart{std::move(mesh), std::move(findings), header->timestamp, header->fps,
                      static_cast<std::size_t>(source.consumed())};
}

}  // namespace

Result<PlyAtStart> read_ply_at_start(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
    PlySource source(bytes);
    skip_white_space(source);
    return read_one(source, options);
}

Result<Mesh> read_ply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options, MeshFindings* findings) {
    auto read = read_ply_at_start(bytes, options);
    if (!read) return tl::unexpected(read.error());
    PlySource rest(bytes.subspan(read->bytes_consumed));
    skip_white_space(rest);
    std::vector<char> line;
    if (const auto next = read_line(rest, line, 16); next && *next == "ply") {
        return fail(ErrorKind::bad_input, "the file holds more than one PLY; give such a file on standard input");
    }
    if (findings) *findings = std::move(read->findings);
    return std::move(read->mesh);
}

Result<std::string> read_ply_timestamp(std::istream& stream) {
    PlySource source(*stream.rdbuf());
    const auto header = read_header(source);
    if (!header) return tl::unexpected(header.error());
    return header->timestamp;
}

PlyStreamReader::PlyStreamReader(std::istream& stream, const MeshReadOptions& options)
    : stream_(stream), options_(options) {}

Result<std::optional<Mesh>> PlyStreamReader::next() {
    if (error_) return tl::unexpected(*error_);
    PlySource source(*stream_.rdbuf());
    if (!skip_white_space(source)) return std::optional<Mesh>();
    auto read = read_one(source, options_);
    if (!read) {
        error_ = Error{read.error().kind,
                       "mesh " + std::to_string(meshes_read_) + " of the stream: " + read.error().message};
        return tl::unexpected(*error_);
    }
    ++meshes_read_;
    timestamp_ = std::move(read->timestamp);
    fps_ = std::move(read->fps);
    findings_ = std::move(read->findings);
    return std::optional<Mesh>(std::move(read->mesh));
}

}  // namespace htvm
