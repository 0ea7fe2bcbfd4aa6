#include "io/ply_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/mesh_check.h"

namespace htvm {

namespace {

// The meaning of a vertex property, and the index of its value in VertexValues.
enum Field { x, y, z, nx, ny, nz, s, t, red, green, blue, field_count, colour_list, ignored };
using VertexValues = std::array<double, field_count>;

// How the properties of a vertex element form a vertex.
struct VertexLayout {
    std::vector<Field> fields;  // of each property
    std::array<PlyType, field_count> type{};
    std::array<std::size_t, field_count> offset{};  // in the vertex's bytes, in a binary file, where it has no lists
    bool lists = false;
    bool normals = false;
    bool texcoords = false;
    bool colours = false;
    bool byte_colours = false;  // all components are of one byte
    std::array<double, 3> origin{};
};

// Names that belong together, in lower case: of the sets for the same fields, the first that is there in full counts.
struct FieldNames {
    Field first;
    std::array<std::string_view, 3> names;
};
constexpr std::array field_names = {
    FieldNames{x, {"x", "y", "z"}},
    FieldNames{nx, {"nx", "ny", "nz"}},
    FieldNames{nx, {"normal_x", "normal_y", "normal_z"}},
    FieldNames{nx, {"normalx", "normaly", "normalz"}},
    FieldNames{s, {"s", "t", ""}},
    FieldNames{s, {"u", "v", ""}},
    FieldNames{s, {"texture_u", "texture_v", ""}},
    FieldNames{s, {"texcoord_u", "texcoord_v", ""}},
    FieldNames{s, {"texture_s", "texture_t", ""}},
    FieldNames{s, {"texcoord_s", "texcoord_t", ""}},
    FieldNames{s, {"texcoord_x", "texcoord_y", ""}},
    FieldNames{s, {"tex_u", "tex_v", ""}},
    FieldNames{s, {"tex_s", "tex_t", ""}},
    FieldNames{s, {"tu", "tv", ""}},
    FieldNames{s, {"uv_u", "uv_v", ""}},
    FieldNames{s, {"s0", "t0", ""}},
    FieldNames{s, {"u0", "v0", ""}},
    FieldNames{s, {"s_0", "t_0", ""}},
    FieldNames{s, {"u_0", "v_0", ""}},
};

// Gives the fields to properties of these names, if all are there and the fields have none yet.
void place(const PlyElement& vertex, Field first, const std::array<std::string_view, 3>& names, bool& is_placed,
           VertexLayout& layout) {
    std::array<std::size_t, 3> properties{};
    for (std::size_t n = 0; n < names.size(); ++n) {
        if (names[n].empty()) continue;
        const auto property = ply_scalar_named(vertex, names[n]);
        if (is_placed || !property) return;
        properties[n] = *property;
    }
    is_placed = true;
    for (std::size_t n = 0; n < names.size() && !names[n].empty(); ++n)
        layout.fields[properties[n]] = static_cast<Field>(first + n);
}

// Colours in another way than this reader takes them.
void remark_on_colours(const PlyElement& vertex, MeshFindings& findings) {
    if (ply_scalar_named(vertex, "f_dc_0")) {
        remark(&findings, "splats",
               "its colours are those of Gaussian splats (f_dc_0 ...), which are not read: it has none", true);
    }
    for (const auto* packed : {"rgb", "rgba"}) {
        if (!ply_scalar_named(vertex, packed)) continue;
        remark(&findings, "packed-colours",
               "its colours are packed into one number (" + std::string(packed) +
                   "), which is not read: it has none; write red, green and blue",
               true);
    }
    for (const auto* grey : {"intensity", "scalar_intensity", "gray", "grey", "luminance"}) {
        if (!ply_scalar_named(vertex, grey)) continue;
        remark(&findings, "grey",
               "its vertices have a level of grey (" + std::string(grey) + "), which is not taken for a colour");
    }
}

Result<VertexLayout> layout_of(const PlyElement& vertex, MeshFindings& findings) {
    VertexLayout layout;
    layout.fields.assign(vertex.properties.size(), ignored);
    bool positions = false;
    for (const auto& [first, names] : field_names) {
        auto& is_placed = first == x ? positions : first == nx ? layout.normals : layout.texcoords;
        place(vertex, first, names, is_placed, layout);
    }
    for (const auto& names : ply_colour_names) place(vertex, red, names, layout.colours, layout);
    if (vertex.count > 0 && !positions)
        return fail(ErrorKind::bad_input, "the PLY header declares no x, y, z for the element \"vertex\"");
    std::size_t offset = 0;
    for (std::size_t p = 0; p < vertex.properties.size(); ++p) {
        const PlyProperty& property = vertex.properties[p];
        if (!property.is_list && layout.fields[p] == ignored &&
            (property.name == "x" || property.name == "y" || property.name == "z"))
            return fail(ErrorKind::bad_input, "the PLY header declares the vertex's " + property.name + " twice");
        if (!layout.colours && is_ply_colour_list(property)) {
            layout.fields[p] = colour_list;
            layout.colours = true;
            for (const auto field : {red, green, blue}) layout.type[field] = property.type;
        } else if (const Field field = layout.fields[p]; field < field_count) {
            layout.type[field] = property.type;
            layout.offset[field] = offset;
        }
        layout.lists = layout.lists || property.is_list;
        offset += ply_type_size(property.type);
    }
    if (!layout.colours) remark_on_colours(vertex, findings);
    const auto is_byte = [&](Field field) { return ply_colour_numbers(layout.type[field]) == ColourNumbers::bytes; };
    layout.byte_colours = is_byte(red) && is_byte(green) && is_byte(blue);
    return layout;
}

// Sets the colour to a list's first three values; false if the bytes end or cannot be read.
bool read_colour_list(PlyBody& body, const PlyProperty& list, VertexValues& value) {
    const auto length = read_list_length(body, list);
    if (!length) return false;
    for (std::uint64_t i = 0; i < *length; ++i) {
        const auto taken = read_value(body, list.type);
        if (!taken) return false;
        if (i < 3) value[red + i] = *taken;
    }
    return true;
}

// False if the bytes end or cannot be read.
bool read_vertex(PlyBody& body, const PlyElement& element, const VertexLayout& layout, VertexValues& value) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (layout.fields[p] == ignored) {
            if (!skip_property(body, property)) return false;
            continue;
        }
        if (layout.fields[p] == colour_list) {
            if (!read_colour_list(body, property, value)) return false;
            continue;
        }
        const auto taken = read_value(body, property.type);
        if (!taken) return false;
        value[layout.fields[p]] = *taken;
    }
    return true;
}

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

float float_or(double value, float otherwise) { return fits_float(value) ? static_cast<float>(value) : otherwise; }

void append_vertex(Mesh& mesh, RawColours& colours, const VertexLayout& layout, const VertexValues& value) {
    Vector3f position{};
    for (std::size_t c = 0; c < 3; ++c) position[c] = float_or(value[x + c] - layout.origin[c], not_a_number);
    mesh.positions.push_back(position);
    if (layout.normals) {
        mesh.normals.push_back({finite_or_zero(value[nx]), finite_or_zero(value[ny]), finite_or_zero(value[nz])});
    }
    if (layout.texcoords) mesh.texcoords.push_back({finite_or_zero(value[s]), finite_or_zero(value[t])});
    if (!layout.colours) return;
    Vector3f colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = finite_or_zero(ply_colour_value(value[red + c], layout.type[red + c]));
    if (layout.byte_colours) {
        mesh.colours.push_back(colour_of(colour, {}, ColourRange::bytes));
    } else {
        colours.values.push_back(colour);
    }
}

// Where vertices lie that all take the same number of bytes: those of a binary file, without lists.
struct VertexBlock {
    const std::uint8_t* bytes = nullptr;
    std::size_t vertices = 0, stride = 0;
    bool big_endian = false;
};

// One property of all vertices as component c of the last elements of `out`.
struct Component {
    std::size_t offset;
    PlyType type;
    float otherwise;    // where it is no finite float
    double origin = 0;  // taken off
};
template <std::size_t size>
void copy_floats(const VertexBlock& block, const Component& component, std::size_t c,
                 std::vector<std::array<float, size>>& out) {
    auto* to = out.data() + (out.size() - block.vertices);
    const auto* from = block.bytes + component.offset;
    const bool plain = component.type == PlyType::f32 && !block.big_endian && component.origin == 0;
    for (std::size_t v = 0; v < block.vertices; ++v, from += block.stride) {
        if (plain) {
            const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(load_bits<4>(from, false)));
            to[v][c] = std::abs(value) <= std::numeric_limits<float>::max() ? value : component.otherwise;
            continue;
        }
        const double value = decode_value(from, component.type, block.big_endian) - component.origin;
        to[v][c] = float_or(value, component.otherwise);
    }
}

void append_colours(Mesh& mesh, RawColours& colours, const VertexLayout& layout, const VertexBlock& block) {
    if (layout.byte_colours) {
        const std::size_t before = mesh.colours.size();
        mesh.colours.resize(before + block.vertices);
        for (std::size_t c = 0; c < 3; ++c) {
            const auto* from = block.bytes + layout.offset[red + c];
            for (std::size_t v = 0; v < block.vertices; ++v, from += block.stride) mesh.colours[before + v][c] = *from;
        }
        return;
    }
    colours.values.resize(colours.values.size() + block.vertices);
    for (std::size_t c = 0; c < 3; ++c) {
        const PlyType type = layout.type[red + c];
        const bool is_signed_byte = type == PlyType::i8;
        copy_floats(block, {layout.offset[red + c], is_signed_byte ? PlyType::u8 : type, 0}, c, colours.values);
    }
}

// Appends a block's vertices, property by property.
void append_block(Mesh& mesh, RawColours& colours, const VertexLayout& layout, const VertexBlock& block) {
    const auto append = [&](auto& out, Field field, float otherwise, const std::array<double, 3>& origin) {
        out.resize(out.size() + block.vertices);
        for (std::size_t c = 0; c < out.front().size(); ++c)
            copy_floats(block, {layout.offset[field + c], layout.type[field + c], otherwise, origin[c]}, c, out);
    };
    if (block.vertices == 0) return;
    append(mesh.positions, x, not_a_number, layout.origin);
    if (layout.normals) append(mesh.normals, nx, 0, {});
    if (layout.texcoords) append(mesh.texcoords, s, 0, {});
    if (layout.colours) append_colours(mesh, colours, layout, block);
}

// Reads vertices of `stride` bytes each, many at a time, in a tenth of the time that one value after another takes.
Result<void> read_vertex_blocks(PlyBody& body, const PlyElement& element, const VertexLayout& layout,
                                std::size_t stride, Mesh& mesh, RawColours& colours) {
    constexpr std::size_t piece = 1 << 16;
    VertexBlock block;
    block.stride = stride;
    block.big_endian = body.format == PlyFormat::binary_big_endian;
    for (std::uint64_t v = 0; v < element.count; v += block.vertices) {
        const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(element.count - v, piece / stride));
        const bool ended = !body.source.ensure(wanted * stride);
        if (ended) return ends_within(element, v + body.source.buffered() / stride);
        block.vertices = wanted;
        block.bytes = body.source.cursor();
        append_block(mesh, colours, layout, block);
        body.source.advance(block.vertices * stride);
    }
    return {};
}

}  // namespace

Result<void> read_ply_vertices(PlyBody& body, const PlyElement& element, const MeshReadOptions& options, Mesh& mesh,
                               RawColours& colours, MeshFindings& findings) {
    auto layout = layout_of(element, findings);
    if (!layout) return tl::unexpected(layout.error());
    layout->origin = options.origin;
    for (std::size_t c = 0; c < 3; ++c) colours.numbers[c] = ply_colour_numbers(layout->type[red + c]);
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    const std::size_t reserved = reservation(body, element.count, std::max<std::uint64_t>(fewest, 1));
    mesh.positions.reserve(reserved);
    if (layout->normals) mesh.normals.reserve(reserved);
    if (layout->texcoords) mesh.texcoords.reserve(reserved);
    if (layout->colours && layout->byte_colours) mesh.colours.reserve(reserved);
    if (layout->colours && !layout->byte_colours) colours.values.reserve(reserved);
    constexpr std::uint64_t most_in_blocks = 4096;  // bytes of a vertex: of more properties hardly any is of use
    if (body.format != PlyFormat::ascii && !layout->lists && fewest <= most_in_blocks && element.count > 0)
        return read_vertex_blocks(body, element, *layout, static_cast<std::size_t>(fewest), mesh, colours);
    for (std::uint64_t v = 0; v < element.count; ++v) {
        VertexValues value{};
        fetch_ahead(body, fewest, element.count - v);
        if (!read_vertex(body, element, *layout, value)) return ends_within(element, v);
        append_vertex(mesh, colours, *layout, value);
    }
    return {};
}

bool is_ply_colour_list(const PlyProperty& property) {
    constexpr std::array<std::string_view, 8> names = {"color", "colour", "colors",       "colours",
                                                       "rgb",   "rgba",   "vertex_color", "face_color"};
    return property.is_list && std::ranges::find(names, property.name) != names.end();
}

ColourNumbers ply_colour_numbers(PlyType type) {
    if (type == PlyType::u8 || type == PlyType::i8) return ColourNumbers::bytes;
    return is_ply_integer(type) ? ColourNumbers::integers : ColourNumbers::fractions;
}

double ply_colour_value(double value, PlyType type) { return type == PlyType::i8 && value < 0 ? value + 256 : value; }

std::optional<std::size_t> ply_scalar_named(const PlyElement& element, std::string_view name) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (!element.properties[p].is_list && element.properties[p].name == name) return p;
    }
    return std::nullopt;
}

}  // namespace htvm
