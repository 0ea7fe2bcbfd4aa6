#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "core/srgb.h"
#include "io/draco_geometry.h"
#include "io/finite_mesh.h"
#include "io/gltf.h"
#include "io/gltf_accessor.h"
#include "io/gltf_file.h"
#include "io/gltf_material.h"
#include "io/gltf_scene.h"

namespace htvm {

using namespace internal;

namespace {

using nlohmann::json;

constexpr std::uint64_t most_drawn = std::uint64_t{1} << 20;  // primitives, of all nodes and instances

tl::unexpected<Error> not_readable(const std::string& why) { return gltf_not_readable(why); }

enum class Mode : std::uint64_t { points = 0, lines = 1, line_strip = 3, triangles = 4, strip = 5, fan = 6 };

// A primitive that is shown.
struct Drawn {
    const json *primitive, *attributes;
    const GltfTransform* transform;
    std::size_t node;  // which of the shown meshes it is of
    Mode mode;
    GltfLook look;
};

// Where the numbers of an attribute are: in an accessor, or in a Draco bitstream, in whose place the accessor says how
// they are meant.
struct AttributeSource {
    std::optional<std::uint64_t> accessor;
    std::optional<std::uint64_t> draco_id;
    auto operator<=>(const AttributeSource&) const = default;
};

// Where vertices come from, and what becomes of them. Primitives of a node that have the same source share them.
struct VertexSource {
    std::size_t node = 0;
    std::optional<std::uint64_t> draco_view;
    AttributeSource positions, normals, colours, texcoords;
    std::array<double, 3> factor{1, 1, 1};
    std::array<double, 6> placed{1, 0, 0, 0, 1, 0};
    auto operator<=>(const VertexSource&) const = default;
};

struct Vertices {
    std::size_t first = 0, count = 0;
};

// A part of the mesh, by which material and image it has; parts are in this order.
using PartKey = std::pair<std::uint64_t, std::optional<std::uint64_t>>;
struct Part {
    std::array<double, 3> factor{1, 1, 1};
    bool is_see_through = false;
    std::size_t place = 0;  // among all, at the end
};

struct Reading {
    GltfFile file;
    const MeshReadOptions& options;
    MeshFindings* findings;
    Mesh mesh = {};  // every attribute as long as the positions until the end
    bool any_image = false;
    bool any_colours = false, any_normals = false, any_texcoords = false;
    std::map<VertexSource, Vertices> vertices = {};     // of the node at work
    std::map<std::uint64_t, DracoGeometry> draco = {};  // by view
    std::map<PartKey, Part> parts = {};
    std::vector<const Part*> part_of_triangle = {};
};

// ---- Attributes -----------------------------------------------------------------------------------------------------

Result<const DracoGeometry*> draco_geometry(Reading& reading, std::uint64_t view_index) {
    if (const auto known = reading.draco.find(view_index); known != reading.draco.end()) return &known->second;
    const auto view = open_gltf_view(reading.file, view_index);
    if (!view) return tl::unexpected(view.error());
    auto geometry = read_draco_geometry(view->bytes, reading.options.limits);
    if (!geometry) return tl::unexpected(geometry.error());
    return &reading.draco.emplace(view_index, std::move(*geometry)).first->second;
}

Result<GltfAccessor> decoded_attribute(Reading& reading, std::uint64_t view, const AttributeSource& source) {
    const auto geometry = draco_geometry(reading, view);
    if (!geometry) return tl::unexpected(geometry.error());
    const auto& attributes = (*geometry)->attributes;
    const auto attribute = std::ranges::find(attributes, *source.draco_id, &DracoAttribute::id);
    if (attribute == attributes.end())
        return not_readable("its Draco data has no attribute " + std::to_string(*source.draco_id));
    auto rows = draco_rows(**geometry, *attribute);
    if (!rows) return tl::unexpected(rows.error());
    GltfAccessor out;
    if (source.accessor) {
        const auto accessor = gltf_item(reading.file, "accessors", *source.accessor);
        if (!accessor) return tl::unexpected(accessor.error());
        const auto* normalised = gltf_member(**accessor, "normalized");
        out.normalised = normalised && normalised->is_boolean() && normalised->get<bool>();
    }
    const bool is_signed = attribute->most == 127 || attribute->most == 32767;
    const bool is_byte = attribute->most && *attribute->most <= 255,
               is_short = attribute->most && *attribute->most <= 65535;
    out.component = !attribute->most ? GltfComponent::f32
                    : is_byte        ? (is_signed ? GltfComponent::i8 : GltfComponent::u8)
                    : is_short       ? (is_signed ? GltfComponent::i16 : GltfComponent::u16)
                                     : GltfComponent::u32;
    out.count = (*geometry)->points;
    out.components = attribute->components;
    out.decoded = std::make_shared<const std::vector<double>>(std::move(*rows));
    return out;
}

Result<GltfAccessor> open_source(Reading& reading, const VertexSource& vertices, const AttributeSource& source) {
    if (source.draco_id) return decoded_attribute(reading, *vertices.draco_view, source);
    return open_accessor(reading.file, *source.accessor);
}

// An attribute of vertices: one row for each at least, of which those behind are passed over.
Result<GltfAccessor> open_attribute(Reading& reading, const VertexSource& vertices, const AttributeSource& source,
                                    const char* name, std::size_t least, std::size_t most, std::uint64_t count) {
    auto accessor = open_source(reading, vertices, source);
    if (!accessor) return tl::unexpected(accessor.error());
    if (accessor->components < least || accessor->components > most)
        return not_readable(std::string(name) + " has " + std::to_string(accessor->components) + " numbers per vertex");
    if (accessor->count < count)
        return not_readable(std::string(name) + " is given for " + std::to_string(accessor->count) + " of " +
                            std::to_string(count) + " vertices");
    accessor->count = count;
    return accessor;
}

void add_normals(Reading& reading, const GltfAccessor& accessor, const GltfTransform& transform) {
    const auto& [x, y, z] = transform.axes;
    const double side = transform.is_mirror() ? -1 : 1;
    for (std::uint64_t row = 0; row < accessor.count; ++row) {
        Vector3d n{};
        for (std::size_t i = 0; i < 3; ++i) n[i] = static_cast<double>(finite_or_zero(accessor.number(row, i)));
        // As surfaces turn: by the cofactors.
        if (!transform.is_identity) n = normalised(cross(y, z) * n[0] + cross(z, x) * n[1] + cross(x, y) * n[2]) * side;
        reading.mesh.normals.push_back({finite_or_zero(n[0]), finite_or_zero(n[1]), finite_or_zero(n[2])});
    }
    reading.any_normals = true;
}

// Positions that no float can hold become such as are not finite, as nothing may use them.
void add_positions(Reading& reading, const GltfAccessor& accessor, const GltfTransform& transform) {
    constexpr auto nowhere = std::numeric_limits<float>::quiet_NaN();
    for (std::uint64_t row = 0; row < accessor.count; ++row) {
        const auto p = transform.moved({accessor.number(row, 0), accessor.number(row, 1), accessor.number(row, 2)}) -
                       reading.options.origin;
        const bool fits = fits_float(p[0]) && fits_float(p[1]) && fits_float(p[2]);
        reading.mesh.positions.push_back(fits ? to_floats(p) : Vector3f{nowhere, nowhere, nowhere});
    }
}

// Integers that do not say so stand for shares all the same: no others are allowed.
void add_colours(Reading& reading, GltfAccessor* accessor, std::uint64_t count, const std::array<double, 3>& factor) {
    if (accessor) accessor->normalised = true;
    for (std::uint64_t row = 0; row < count; ++row) {
        Colour colour{};
        for (std::size_t i = 0; i < 3; ++i)
            colour[i] = level_of(finite_or_zero((accessor ? accessor->number(row, i) : 1.0) * factor[i]));
        reading.mesh.colours.push_back(colour);
    }
    reading.any_colours = reading.any_colours || accessor;
}

// glTF's v runs downwards.
void add_texcoords(Reading& reading, const GltfAccessor& accessor, const std::array<double, 6>& placed) {
    for (std::uint64_t row = 0; row < accessor.count; ++row) {
        const double u = accessor.number(row, 0), v = accessor.number(row, 1);
        reading.mesh.texcoords.push_back({finite_or_zero(placed[0] * u + placed[1] * v + placed[2]),
                                          finite_or_zero(1 - (placed[3] * u + placed[4] * v + placed[5]))});
    }
    reading.any_texcoords = true;
}

bool is_given(const AttributeSource& source) { return source.accessor || source.draco_id; }

Result<Vertices> add_vertices(Reading& reading, const VertexSource& source, const GltfTransform& transform) {
    if (const auto known = reading.vertices.find(source); known != reading.vertices.end()) return known->second;
    const auto positions = open_source(reading, source, source.positions);
    if (!positions) return tl::unexpected(positions.error());
    if (positions->components != 3) return not_readable("POSITION does not have three numbers per vertex");
    Mesh& mesh = reading.mesh;
    const auto count = positions->count, most = reading.options.limits.most_vertices;
    if (auto ok = check_count(count, most, "vertices"); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_count(mesh.positions.size() + count, most, "vertices"); !ok) return tl::unexpected(ok.error());
    add_positions(reading, *positions, transform);
    if (is_given(source.normals)) {
        const auto normals = open_attribute(reading, source, source.normals, "NORMAL", 3, 3, count);
        if (!normals) return tl::unexpected(normals.error());
        add_normals(reading, *normals, transform);
    }
    std::optional<GltfAccessor> colours;
    if (is_given(source.colours)) {
        auto opened = open_attribute(reading, source, source.colours, "COLOR_0", 3, 4, count);
        if (!opened) return tl::unexpected(opened.error());
        colours = std::move(*opened);
    }
    add_colours(reading, colours ? &*colours : nullptr, count, source.factor);
    if (is_given(source.texcoords)) {
        const auto texcoords = open_attribute(reading, source, source.texcoords, "TEXCOORD", 2, 4, count);
        if (!texcoords) return tl::unexpected(texcoords.error());
        add_texcoords(reading, *texcoords, source.placed);
    }
    mesh.normals.resize(mesh.positions.size());
    mesh.texcoords.resize(mesh.positions.size());
    const Vertices added{mesh.positions.size() - static_cast<std::size_t>(count), static_cast<std::size_t>(count)};
    reading.vertices.emplace(source, added);
    return added;
}

// ---- Triangles ------------------------------------------------------------------------------------------------------

// The corners of a primitive: its indices, or the vertices one after the other.
struct Corners {
    std::optional<GltfAccessor> indices;
    std::uint64_t count = 0;
    std::uint64_t vertices = 0;
    std::uint64_t restart = std::numeric_limits<std::uint64_t>::max();  // an index at which triangles begin anew

    std::uint64_t at(std::uint64_t place) const { return indices ? indices->whole(place) : place; }
    bool is_restart(std::uint64_t place) const {
        const auto index = at(place);
        return indices && index == restart && index >= vertices;
    }
};

Result<Corners> open_corners(Reading& reading, const json& primitive, const Vertices& vertices) {
    Corners out;
    out.vertices = out.count = vertices.count;
    const auto index = gltf_index(primitive, "indices");
    if (!index) return tl::unexpected(index.error());
    if (!*index) return out;
    auto opened = open_accessor(reading.file, **index);
    if (!opened) return tl::unexpected(opened.error());
    const auto type = opened->component;
    const bool whole = type == GltfComponent::u8 || type == GltfComponent::u16 || type == GltfComponent::u32;
    if (!whole || opened->components != 1) return not_readable("the indices of a primitive are no whole numbers");
    out.restart = type == GltfComponent::u8 ? 0xFF : type == GltfComponent::u16 ? 0xFFFF : 0xFFFFFFFF;
    out.count = opened->count;
    out.indices = std::move(*opened);
    return out;
}

// The corners of triangle `t` of those from `first` on.
std::array<std::uint64_t, 3> corners_of(Mode mode, std::uint64_t first, std::uint64_t t) {
    const auto at = first + t;
    if (mode == Mode::strip) return t % 2 == 0 ? std::array{at, at + 1, at + 2} : std::array{at, at + 2, at + 1};
    if (mode == Mode::fan) return {at + 1, at + 2, first};
    return {first + 3 * t, first + 3 * t + 1, first + 3 * t + 2};
}

Result<void> add_triangle(Reading& reading, std::array<std::uint64_t, 3> corners, const Vertices& vertices,
                          bool mirrored, const Part* part) {
    Triangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
        if (corners[i] >= vertices.count)
            return not_readable("a triangle uses vertex " + std::to_string(corners[i]) + " of a primitive that has " +
                                std::to_string(vertices.count));
        triangle[i] = static_cast<std::uint32_t>(vertices.first + corners[i]);
    }
    if (mirrored) std::swap(triangle[1], triangle[2]);
    reading.mesh.triangles.push_back(triangle);
    reading.part_of_triangle.push_back(part);
    return {};
}

Result<void> add_triangles(Reading& reading, const Drawn& drawn, const Vertices& vertices, const Part* part) {
    const auto corners = open_corners(reading, *drawn.primitive, vertices);
    if (!corners) return tl::unexpected(corners.error());
    const auto count_of = [&](std::uint64_t length) {
        return drawn.mode == Mode::triangles ? length / 3 : std::max<std::uint64_t>(length, 2) - 2;
    };
    const auto most = reading.options.limits.most_triangles, all = count_of(corners->count);
    if (auto ok = check_count(all, most, "triangles"); !ok) return ok;
    if (auto ok = check_count(reading.mesh.triangles.size() + all, most, "triangles"); !ok) return ok;
    const bool mirrored = drawn.transform->is_mirror();
    for (std::uint64_t first = 0, end = 0; first < corners->count; first = end + 1) {
        for (end = first; end < corners->count && !corners->is_restart(end);) ++end;
        for (std::uint64_t t = 0; t < count_of(end - first); ++t) {
            auto triangle = corners_of(drawn.mode, first, t);
            for (auto& corner : triangle) corner = corners->at(corner);
            if (auto ok = add_triangle(reading, triangle, vertices, mirrored, part); !ok) return ok;
        }
    }
    return {};
}

Result<void> add_decoded_triangles(Reading& reading, const DracoGeometry& geometry, const Drawn& drawn,
                                   const Vertices& vertices, const Part* part) {
    const auto most = reading.options.limits.most_triangles;
    if (auto ok = check_count(reading.mesh.triangles.size() + geometry.triangles.size(), most, "triangles"); !ok)
        return ok;
    const bool mirrored = drawn.transform->is_mirror();
    for (const auto& [a, b, c] : geometry.triangles)
        if (auto ok = add_triangle(reading, {a, b, c}, vertices, mirrored, part); !ok) return ok;
    return {};
}

// ---- Primitives -----------------------------------------------------------------------------------------------------

Result<VertexSource> source_of(const Drawn& drawn, bool any_image) {
    VertexSource out;
    out.node = drawn.node;
    out.placed = drawn.look.placed;
    // Where there are images, the factor is their part's.
    if (!any_image) out.factor = drawn.look.factor;
    const json* decoded = nullptr;
    if (const auto* draco = gltf_extension(*drawn.primitive, "KHR_draco_mesh_compression")) {
        const auto view = gltf_index(*draco, "bufferView");
        if (!view) return tl::unexpected(view.error());
        if (!*view) return not_readable("a primitive has no Draco data");
        out.draco_view = *view;
        decoded = gltf_member(*draco, "attributes");
    }
    const auto texcoord = "TEXCOORD_" + std::to_string(drawn.look.texcoord_set);
    const auto named = {std::pair{"POSITION", &out.positions}, std::pair{"NORMAL", &out.normals},
                        std::pair{"COLOR_0", &out.colours}, std::pair{texcoord.c_str(), &out.texcoords}};
    for (const auto& [name, source] : named) {
        const auto index = gltf_index(*drawn.attributes, name);
        const auto id = decoded ? gltf_index(*decoded, name) : std::optional<std::uint64_t>();
        if (!index) return tl::unexpected(index.error());
        if (!id) return tl::unexpected(id.error());
        *source = {*index, *id};
    }
    if (!drawn.look.takes_vertex_colours) out.colours = {};
    return out;
}

Result<void> add_primitive(Reading& reading, const Drawn& drawn) {
    const auto source = source_of(drawn, reading.any_image);
    if (!source) return tl::unexpected(source.error());
    const auto vertices = add_vertices(reading, *source, *drawn.transform);
    if (!vertices) return tl::unexpected(vertices.error());
    if (drawn.mode == Mode::points) return {};
    const auto& look = drawn.look;
    const PartKey key{look.material.value_or(std::numeric_limits<std::uint64_t>::max()), look.image};
    const Part* part = &reading.parts.emplace(key, Part{look.factor, look.is_see_through}).first->second;
    if (!source->draco_view) return add_triangles(reading, drawn, *vertices, part);
    const auto geometry = draco_geometry(reading, *source->draco_view);
    if (!geometry) return tl::unexpected(geometry.error());
    return add_decoded_triangles(reading, **geometry, drawn, *vertices, part);
}

// The primitive as it is to be drawn; nothing if it shows nothing that is read here.
Result<std::optional<Drawn>> drawn_as(const GltfFile& file, const json& primitive, MeshFindings* findings) {
    const auto mode = gltf_number(primitive, "mode", static_cast<std::uint64_t>(Mode::triangles));
    if (!mode) return tl::unexpected(mode.error());
    if (*mode > static_cast<std::uint64_t>(Mode::fan))
        return not_readable("a primitive has the unknown mode " + std::to_string(*mode));
    const auto* attributes = gltf_member(primitive, "attributes");
    if (!attributes || !gltf_member(*attributes, "POSITION")) return std::optional<Drawn>();
    if (*mode >= static_cast<std::uint64_t>(Mode::lines) && *mode <= static_cast<std::uint64_t>(Mode::line_strip)) {
        remark(findings, "lines", "it has lines, which are passed over", true);
        return std::optional<Drawn>();
    }
    auto look = gltf_look(file, primitive, findings);
    if (!look) return tl::unexpected(look.error());
    if (!look->is_shown) return std::optional<Drawn>();
    const auto texcoord = "TEXCOORD_" + std::to_string(look->texcoord_set);
    if (look->image && !gltf_member(*attributes, texcoord.c_str())) {
        remark(findings, "no-coordinates",
               "a part of it has an image and no texture coordinates: the image is left out", true);
        look->image.reset();
    }
    return std::optional(Drawn{&primitive, attributes, nullptr, 0, static_cast<Mode>(*mode), *look});
}

// Everything that is shown. Points beside triangles are not: they would be vertices that nothing uses.
Result<std::vector<Drawn>> all_drawn(const GltfFile& file, const std::vector<GltfShownMesh>& meshes,
                                     MeshFindings* findings) {
    std::vector<Drawn> out;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        const auto mesh = gltf_item(file, "meshes", meshes[m].mesh);
        if (!mesh) return tl::unexpected(mesh.error());
        const auto* primitives = gltf_member(**mesh, "primitives");
        if (!primitives || !primitives->is_array()) continue;
        if (auto ok = check_count(out.size() + primitives->size(), most_drawn, "parts"); !ok)
            return tl::unexpected(ok.error());
        for (const auto& primitive : *primitives) {
            auto drawn = drawn_as(file, primitive, findings);
            if (!drawn) return tl::unexpected(drawn.error());
            if (!*drawn) continue;
            (*drawn)->transform = &meshes[m].transform;
            (*drawn)->node = m;
            out.push_back(**drawn);
        }
    }
    const auto is_point = [](const Drawn& drawn) { return drawn.mode == Mode::points; };
    const auto points = std::ranges::count_if(out, is_point);
    if (points > 0 && points < std::ssize(out)) {
        std::erase_if(out, is_point);
        remark(findings, "points", "it has points beside its triangles, which are passed over", true);
    }
    return out;
}

// ---- What it looks like ---------------------------------------------------------------------------------------------

Colour levels_of(const std::array<double, 3>& light) {
    return {level_of(finite_or_zero(light[0])), level_of(finite_or_zero(light[1])), level_of(finite_or_zero(light[2]))};
}

// Whether materials alone tell parts apart, or give all of it a colour. A grey for all of it says nothing.
bool are_coloured_by_materials(const std::vector<Drawn>& drawn) {
    return std::ranges::any_of(drawn, [&](const Drawn& part) {
        const auto [r, g, b] = levels_of(part.look.factor);
        return part.look.factor != drawn[0].look.factor || r != g || g != b;
    });
}

Result<std::size_t> image_in(Reading& reading, TextureReference& texture, std::uint64_t index, bool is_see_through) {
    auto image = gltf_image_at(reading.file, index);
    if (!image) return tl::unexpected(image.error());
    const auto& bytes = image->bytes;
    const bool is_jpeg = bytes.size() > 1 ? bytes[0] == 0xFF && bytes[1] == 0xD8
                                          : image->name.ends_with(".jpg") || image->name.ends_with(".jpeg");
    if (is_see_through && !is_jpeg)
        remark(reading.findings, "alpha",
               "its materials may be see-through by the alpha of their image (alphaMode), which is passed over", true);
    const auto known = std::ranges::find(texture.images, image->name, &TextureReference::Image::name);
    const auto place = static_cast<std::size_t>(known - texture.images.begin());
    if (known == texture.images.end()) texture.images.push_back(std::move(*image));
    return place;
}

// The parts in the order of the materials; those that look alike are one.
Result<TextureReference> texture_of(Reading& reading) {
    TextureReference out;
    out.colours_multiply = true;
    for (auto& [key, part] : reading.parts) {
        TextureReference::Part look;
        if (key.second) {
            const auto image = image_in(reading, out, *key.second, part.is_see_through);
            if (!image) return tl::unexpected(image.error());
            look.image = *image;
        }
        const auto colour = levels_of(part.factor);
        if (reading.any_image && colour != Colour{255, 255, 255}) look.colour = colour;
        const auto same = std::ranges::find_if(
            out.parts, [&](const auto& other) { return other.image == look.image && other.colour == look.colour; });
        part.place = static_cast<std::size_t>(same - out.parts.begin());
        if (same == out.parts.end()) out.parts.push_back(look);
    }
    if (auto ok = check_count(out.parts.size(), std::numeric_limits<std::uint16_t>::max(), "materials"); !ok)
        return tl::unexpected(ok.error());
    if (out.parts.size() > 1)
        for (const auto* part : reading.part_of_triangle)
            out.part_of_triangle.push_back(static_cast<std::uint16_t>(part->place));
    return out;
}

// Only attributes that some vertex has are kept.
void drop_what_is_not_there(Reading& reading) {
    auto& mesh = reading.mesh;
    // White multiplies images by one.
    const bool all_white = std::ranges::all_of(mesh.colours, [](const auto& c) { return c == Colour{255, 255, 255}; });
    if (!reading.any_colours || (reading.any_image && all_white)) mesh.colours.clear();
    if (!reading.any_normals) mesh.normals.clear();
    if (!reading.any_texcoords) mesh.texcoords.clear();
}

}  // namespace

Result<Mesh> read_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder,
                       const MeshReadOptions& options, MeshFindings* findings) {
    auto file = open_gltf(bytes, folder);
    if (!file) return tl::unexpected(file.error());
    if (auto ok = check_gltf_extensions(file->root, findings); !ok) return tl::unexpected(ok.error());
    Reading reading{std::move(*file), options, findings};
    const auto meshes = gltf_shown_meshes(reading.file, findings);
    if (!meshes) return tl::unexpected(meshes.error());
    const auto drawn = all_drawn(reading.file, *meshes, findings);
    if (!drawn) return tl::unexpected(drawn.error());
    reading.any_image = std::ranges::any_of(*drawn, [](const auto& part) { return part.look.image.has_value(); });
    reading.any_colours = !reading.any_image && are_coloured_by_materials(*drawn);
    for (std::size_t d = 0; d < drawn->size(); ++d) {
        if (d > 0 && (*drawn)[d].node != (*drawn)[d - 1].node) reading.vertices.clear();
        if (auto ok = add_primitive(reading, (*drawn)[d]); !ok) return tl::unexpected(ok.error());
    }
    drop_what_is_not_there(reading);
    auto texture = texture_of(reading);
    if (!texture) return tl::unexpected(texture.error());
    MeshFindings unheard;
    auto& told = findings ? *findings : unheard;
    told.texture = std::move(*texture);
    if (auto ok = leave_out_not_finite(reading.mesh, told); !ok) return tl::unexpected(ok.error());
    return std::move(reading.mesh);
}

}  // namespace htvm
