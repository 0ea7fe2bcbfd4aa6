#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "core/srgb.h"
#include "io/gltf.h"
#include "io/gltf_file.h"
#include "io/skeleton_json_value.h"

namespace htvm {

using namespace internal;

namespace {

using nlohmann::json;

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the glTF cannot be read: " + why);
}

// ---- Transforms of nodes --------------------------------------------------------------------------------------------

struct Transform {
    std::array<Vector3d, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // where the unit vectors go
    Vector3d origin{};
    bool is_identity = true;

    Vector3d turned(const Vector3d& v) const { return axes[0] * v[0] + axes[1] * v[1] + axes[2] * v[2]; }
    Vector3d moved(const Vector3d& p) const { return turned(p) + origin; }
};

// First b, then a.
Transform composed(const Transform& a, const Transform& b) {
    if (a.is_identity) return b;
    if (b.is_identity) return a;
    return {{a.turned(b.axes[0]), a.turned(b.axes[1]), a.turned(b.axes[2])}, a.moved(b.origin), false};
}

// The node's own, relative to its parent.
Result<Transform> transform_of(const json& node) {
    const bool has_matrix = find_member(node, "matrix") != nullptr;
    const auto m = gltf_numbers<16>(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    const auto move = gltf_numbers<3>(node, "translation", {0, 0, 0});
    const auto turn = gltf_numbers<4>(node, "rotation", {0, 0, 0, 1});
    const auto scale = gltf_numbers<3>(node, "scale", {1, 1, 1});
    if (!m) return tl::unexpected(m.error());
    if (!move) return tl::unexpected(move.error());
    if (!turn) return tl::unexpected(turn.error());
    if (!scale) return tl::unexpected(scale.error());
    Transform out;
    if (has_matrix) {
        for (std::size_t i = 0; i < 3; ++i) out.axes[i] = {(*m)[4 * i], (*m)[4 * i + 1], (*m)[4 * i + 2]};
        out.origin = {(*m)[12], (*m)[13], (*m)[14]};
    } else {
        const auto& [x, y, z, w] = *turn;
        const auto& s = *scale;
        out.axes[0] = Vector3d{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * s[0];
        out.axes[1] = Vector3d{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * s[1];
        out.axes[2] = Vector3d{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * s[2];
        out.origin = *move;
    }
    const Transform identity;
    out.is_identity = out.axes == identity.axes && out.origin == identity.origin;
    return out;
}

// ---- Vertices -------------------------------------------------------------------------------------------------------

// The accessors that vertices come from, and the colour that multiplies theirs.
struct VertexSource {
    std::optional<std::uint64_t> positions, normals, colours, texcoords;
    std::array<double, 4> factor{1, 1, 1, 1};
    std::array<double, 6> placed{1, 0, 0, 0, 1, 0};  // texture coordinates: two rows of x, y and 1
    auto operator<=>(const VertexSource&) const = default;
};

struct Vertices {
    std::size_t first = 0, count = 0;
};

struct Reading {
    GltfFile file;
    const MeshLimits& limits;
    Mesh mesh = {};  // every attribute as long as the positions until the end
    bool any_colours = false, any_normals = false, any_texcoords = false;
    bool any_without_image = false;
    TextureReference texture = {};
    std::map<VertexSource, Vertices> of_node = {};  // vertices of the node at work that primitives may share
};

// An attribute's accessor, which has as many rows as there are positions.
Result<GltfAccessor> open_attribute(Reading& reading, std::uint64_t index, const char* name, std::size_t least,
                                    std::size_t most, std::uint64_t count) {
    auto accessor = open_accessor(reading.file, index);
    if (!accessor) return tl::unexpected(accessor.error());
    if (accessor->components < least || accessor->components > most)
        return not_readable(std::string(name) + " has " + std::to_string(accessor->components) + " numbers per vertex");
    if (accessor->count != count)
        return not_readable(std::string(name) + " is given for " + std::to_string(accessor->count) + " of " +
                            std::to_string(count) + " vertices");
    return accessor;
}

Result<void> add_normals(Reading& reading, const GltfAccessor& accessor, const Transform& transform) {
    const auto& [x, y, z] = transform.axes;
    const double side = dot(cross(x, y), z) < 0 ? -1 : 1;
    for (std::uint64_t row = 0; row < accessor.count; ++row) {
        Vector3d n{};
        for (std::size_t i = 0; i < 3; ++i) n[i] = static_cast<double>(finite_or_zero(accessor.number(row, i)));
        // As surfaces turn: by the cofactors.
        if (!transform.is_identity) n = normalised(cross(y, z) * n[0] + cross(z, x) * n[1] + cross(x, y) * n[2]) * side;
        reading.mesh.normals.push_back({finite_or_zero(n[0]), finite_or_zero(n[1]), finite_or_zero(n[2])});
    }
    reading.any_normals = true;
    return {};
}

Result<void> add_positions(Reading& reading, const GltfAccessor& accessor, const Transform& transform) {
    for (std::uint64_t row = 0; row < accessor.count; ++row) {
        Vector3d p{accessor.number(row, 0), accessor.number(row, 1), accessor.number(row, 2)};
        if (!transform.is_identity) p = transform.moved(p);
        if (!fits_float(p[0]) || !fits_float(p[1]) || !fits_float(p[2]))
            return not_readable("the position of vertex " + std::to_string(reading.mesh.positions.size()) +
                                " is not finite");
        reading.mesh.positions.push_back(to_floats(p));
    }
    return {};
}

void add_colours(Reading& reading, const GltfAccessor* accessor, std::uint64_t count,
                 const std::array<double, 4>& factor) {
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

Result<Vertices> add_vertices(Reading& reading, const VertexSource& source, const Transform& transform) {
    if (const auto known = reading.of_node.find(source); known != reading.of_node.end()) return known->second;
    const auto positions = open_accessor(reading.file, *source.positions);
    if (!positions) return tl::unexpected(positions.error());
    if (positions->components != 3) return not_readable("POSITION does not have three numbers per vertex");
    Mesh& mesh = reading.mesh;
    const auto count = positions->count;
    if (auto ok = check_count(count, reading.limits.most_vertices, "vertices"); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_count(mesh.positions.size() + count, reading.limits.most_vertices, "vertices"); !ok)
        return tl::unexpected(ok.error());
    if (auto ok = add_positions(reading, *positions, transform); !ok) return tl::unexpected(ok.error());
    if (source.normals) {
        const auto normals = open_attribute(reading, *source.normals, "NORMAL", 3, 3, count);
        if (!normals) return tl::unexpected(normals.error());
        if (auto ok = add_normals(reading, *normals, transform); !ok) return tl::unexpected(ok.error());
    }
    std::optional<GltfAccessor> colours;
    if (source.colours) {
        auto opened = open_attribute(reading, *source.colours, "COLOR_0", 3, 4, count);
        if (!opened) return tl::unexpected(opened.error());
        colours = *opened;
    }
    add_colours(reading, colours ? &*colours : nullptr, count, source.factor);
    if (source.texcoords) {
        const auto texcoords = open_attribute(reading, *source.texcoords, "TEXCOORD_0", 2, 2, count);
        if (!texcoords) return tl::unexpected(texcoords.error());
        add_texcoords(reading, *texcoords, source.placed);
    }
    mesh.normals.resize(mesh.positions.size());
    mesh.texcoords.resize(mesh.positions.size());
    const Vertices added{mesh.positions.size() - static_cast<std::size_t>(count), static_cast<std::size_t>(count)};
    reading.of_node.emplace(source, added);
    return added;
}

// ---- Primitives -----------------------------------------------------------------------------------------------------

// glTF's numbers for what vertices are joined to.
enum class Mode : std::uint64_t { points = 0, triangles = 4, strip = 5, fan = 6 };

// The corners of triangle t.
std::array<std::uint64_t, 3> corners_of(Mode mode, std::uint64_t t) {
    if (mode == Mode::strip) return t % 2 == 0 ? std::array{t, t + 1, t + 2} : std::array{t, t + 2, t + 1};
    if (mode == Mode::fan) return {t + 1, t + 2, 0};
    return {3 * t, 3 * t + 1, 3 * t + 2};
}

Result<void> add_triangles(Reading& reading, Mode mode, const Vertices& vertices,
                           const std::optional<std::uint64_t>& index_accessor, bool mirrored) {
    std::optional<GltfAccessor> indices;
    if (index_accessor) {
        auto opened = open_accessor(reading.file, *index_accessor);
        if (!opened) return tl::unexpected(opened.error());
        const auto type = opened->component;
        const bool whole = type == GltfComponent::u8 || type == GltfComponent::u16 || type == GltfComponent::u32;
        if (!whole || opened->components != 1) return not_readable("the indices of a primitive are no whole numbers");
        indices = *opened;
    }
    const std::uint64_t corners = indices ? indices->count : vertices.count;
    const std::uint64_t count = mode == Mode::triangles ? corners / 3 : std::max<std::uint64_t>(corners, 2) - 2;
    auto& triangles = reading.mesh.triangles;
    if (auto ok = check_count(count, reading.limits.most_triangles, "triangles"); !ok) return ok;
    if (auto ok = check_count(triangles.size() + count, reading.limits.most_triangles, "triangles"); !ok) return ok;
    for (std::uint64_t t = 0; t < count; ++t) {
        Triangle triangle{};
        const auto at = corners_of(mode, t);
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint64_t index = indices ? indices->whole(at[i]) : at[i];
            if (index >= vertices.count)
                return not_readable("a triangle uses vertex " + std::to_string(index) + " of a primitive that has " +
                                    std::to_string(vertices.count));
            triangle[i] = static_cast<std::uint32_t>(vertices.first + index);
        }
        if (mirrored) std::swap(triangle[1], triangle[2]);
        triangles.push_back(triangle);
    }
    return {};
}

// Which image a texture shows; nothing if it names none that is read here.
Result<std::optional<std::uint64_t>> image_of_texture(const GltfFile& file, std::uint64_t index) {
    const auto texture = gltf_item(file, "textures", index);
    if (!texture) return tl::unexpected(texture.error());
    if (const auto* extensions = find_member(**texture, "extensions"))
        if (const auto* webp = find_member(*extensions, "EXT_texture_webp")) return gltf_index(*webp, "source");
    return gltf_index(**texture, "source");
}

// KHR_texture_transform: scaled, turned, moved.
Result<std::array<double, 6>> placed_by(const json& transform) {
    const auto offset = gltf_numbers<2>(transform, "offset", {0, 0});
    const auto scale = gltf_numbers<2>(transform, "scale", {1, 1});
    const auto* turn = find_member(transform, "rotation");
    const auto angle = turn ? finite_number(*turn) : Result<double>(0);
    if (!offset) return tl::unexpected(offset.error());
    if (!scale) return tl::unexpected(scale.error());
    if (!angle) return not_readable("a \"rotation\" is no number");
    const double c = std::cos(*angle), s = std::sin(*angle);
    return std::array<double, 6>{c * (*scale)[0],  s * (*scale)[1], (*offset)[0],
                                 -s * (*scale)[0], c * (*scale)[1], (*offset)[1]};
}

// The base colour's image, and which texture coordinates it takes.
Result<void> add_texture(Reading& reading, const json& texture, const json& attributes, VertexSource& source) {
    const auto index = gltf_index(texture, "index");
    const auto set = gltf_number(texture, "texCoord", 0);
    if (!index) return tl::unexpected(index.error());
    if (!set) return tl::unexpected(set.error());
    if (!*index) return {};
    const auto image = image_of_texture(reading.file, **index);
    if (!image) return tl::unexpected(image.error());
    std::uint64_t of_set = *set;
    if (const auto* extensions = find_member(texture, "extensions"))
        if (const auto* transform = find_member(*extensions, "KHR_texture_transform")) {
            const auto placed = placed_by(*transform);
            if (!placed) return tl::unexpected(placed.error());
            source.placed = *placed;
            const auto other = gltf_number(*transform, "texCoord", of_set);
            if (!other) return tl::unexpected(other.error());
            of_set = *other;
        }
    if (of_set > 0) {
        const auto name = "TEXCOORD_" + std::to_string(of_set);
        const auto accessor = gltf_index(attributes, name.c_str());
        if (!accessor) return tl::unexpected(accessor.error());
        source.texcoords = *accessor;
    }
    if (!*image) return {};
    auto found = gltf_image_at(reading.file, **image);
    if (!found) return tl::unexpected(found.error());
    auto& images = reading.texture.images;
    const bool is_known =
        std::any_of(images.begin(), images.end(), [&](const auto& other) { return other.name == found->name; });
    if (!is_known) images.push_back(std::move(*found));
    return {};
}

Result<void> add_material(Reading& reading, const json& primitive, const json& attributes, VertexSource& source) {
    const auto index = gltf_index(primitive, "material");
    if (!index) return tl::unexpected(index.error());
    const json* surface = nullptr;
    if (*index) {
        const auto material = gltf_item(reading.file, "materials", **index);
        if (!material) return tl::unexpected(material.error());
        surface = find_member(**material, "pbrMetallicRoughness");
    }
    const auto* texture = surface ? find_member(*surface, "baseColorTexture") : nullptr;
    if (!texture) reading.any_without_image = true;
    if (!surface) return {};
    const auto factor = gltf_numbers<4>(*surface, "baseColorFactor", source.factor);
    if (!factor) return tl::unexpected(factor.error());
    source.factor = *factor;
    return texture ? add_texture(reading, *texture, attributes, source) : Result<void>();
}

Result<void> add_primitive(Reading& reading, const json& primitive, const Transform& transform) {
    const auto mode = gltf_number(primitive, "mode", static_cast<std::uint64_t>(Mode::triangles));
    if (!mode) return tl::unexpected(mode.error());
    if (*mode > static_cast<std::uint64_t>(Mode::fan))
        return not_readable("a primitive has the unknown mode " + std::to_string(*mode));
    const bool lines =
        *mode > static_cast<std::uint64_t>(Mode::points) && *mode < static_cast<std::uint64_t>(Mode::triangles);
    const auto* attributes = find_member(primitive, "attributes");
    if (lines || !attributes || !find_member(*attributes, "POSITION")) return {};  // nothing to show
    VertexSource source;
    const auto named = {std::pair{"POSITION", &source.positions}, std::pair{"NORMAL", &source.normals},
                        std::pair{"COLOR_0", &source.colours}, std::pair{"TEXCOORD_0", &source.texcoords}};
    for (const auto& [name, accessor] : named) {
        const auto index = gltf_index(*attributes, name);
        if (!index) return tl::unexpected(index.error());
        *accessor = *index;
    }
    const auto indices = gltf_index(primitive, "indices");
    if (!indices) return tl::unexpected(indices.error());
    if (auto ok = add_material(reading, primitive, *attributes, source); !ok) return ok;
    const auto vertices = add_vertices(reading, source, transform);
    if (!vertices) return tl::unexpected(vertices.error());
    if (*mode == static_cast<std::uint64_t>(Mode::points)) return {};
    const auto& [x, y, z] = transform.axes;
    return add_triangles(reading, static_cast<Mode>(*mode), *vertices, *indices, dot(cross(x, y), z) < 0);
}

// ---- The scene ------------------------------------------------------------------------------------------------------

bool any_weight(const json& object) {
    const auto* weights = find_member(object, "weights");
    if (!weights || !weights->is_array()) return false;
    return std::any_of(weights->begin(), weights->end(),
                       [](const json& weight) { return !weight.is_number() || weight.get<double>() != 0; });
}

Result<void> add_mesh(Reading& reading, const json& node, std::uint64_t index, const Transform& transform) {
    const auto mesh = gltf_item(reading.file, "meshes", index);
    if (!mesh) return tl::unexpected(mesh.error());
    if (find_member(node, "skin"))
        return fail(ErrorKind::unsupported,
                    "the glTF has a mesh that a skeleton moves (skin), which is not read; export "
                    "it with the pose applied");
    if (find_member(node, "weights") ? any_weight(node) : any_weight(**mesh))
        return fail(ErrorKind::unsupported,
                    "the glTF has a mesh that morph targets change, which are not read; export "
                    "it with the shape applied");
    const auto* primitives = find_member(**mesh, "primitives");
    if (!primitives || !primitives->is_array()) return {};
    reading.of_node.clear();
    for (const auto& primitive : *primitives)
        if (auto ok = add_primitive(reading, primitive, transform); !ok) return ok;
    return {};
}

// The numbers in a list of nodes, such as children.
Result<std::vector<std::uint64_t>> nodes_in(const json& object, const char* name) {
    std::vector<std::uint64_t> out;
    const auto* list = find_member(object, name);
    if (!list) return out;
    if (!list->is_array()) return not_readable(std::string("\"") + name + "\" is no list");
    for (const auto& node : *list) {
        if (!node.is_number_unsigned())
            return not_readable(std::string("\"") + name + "\" does not list numbers of nodes");
        out.push_back(node.get<std::uint64_t>());
    }
    return out;
}

// The nodes that are shown first: those of the scene; of all, without one, those that are nobody's child.
Result<std::vector<std::uint64_t>> roots_of(const GltfFile& file) {
    const auto* scenes = find_member(file.root, "scenes");
    const auto scene = gltf_number(file.root, "scene", 0);
    if (!scene) return tl::unexpected(scene.error());
    if (scenes && scenes->is_array() && !scenes->empty()) {
        const auto shown = gltf_item(file, "scenes", *scene);
        if (!shown) return tl::unexpected(shown.error());
        return nodes_in(**shown, "nodes");
    }
    const auto* nodes = find_member(file.root, "nodes");
    const std::size_t count = nodes && nodes->is_array() ? nodes->size() : 0;
    std::vector<bool> is_child(count);
    for (std::size_t n = 0; n < count; ++n) {
        const auto children = nodes_in((*nodes)[n], "children");
        if (!children) return tl::unexpected(children.error());
        for (const auto child : *children)
            if (child < count) is_child[static_cast<std::size_t>(child)] = true;
    }
    std::vector<std::uint64_t> out;
    for (std::size_t n = 0; n < count; ++n)
        if (!is_child[n]) out.push_back(n);
    return out;
}

Result<void> add_scene(Reading& reading) {
    struct Shown {
        const json* node;
        Transform parent;
    };
    std::vector<Shown> next;
    std::vector<bool> met;
    const auto show = [&](const std::vector<std::uint64_t>& numbers, const Transform& parent) -> Result<void> {
        for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
            const auto node = gltf_item(reading.file, "nodes", *number);
            if (!node) return tl::unexpected(node.error());
            const auto place = static_cast<std::size_t>(*number);
            if (place >= met.size()) met.resize(place + 1);
            if (met[place])
                return not_readable("node " + std::to_string(place) + " has two parents, or is part of a circle");
            met[place] = true;
            next.push_back({*node, parent});
        }
        return {};
    };
    const auto roots = roots_of(reading.file);
    if (!roots) return tl::unexpected(roots.error());
    if (auto ok = show(*roots, {}); !ok) return ok;
    while (!next.empty()) {
        const auto [node, parent] = next.back();
        next.pop_back();
        const auto own = transform_of(*node);
        if (!own) return tl::unexpected(own.error());
        const Transform transform = composed(parent, *own);
        const auto mesh = gltf_index(*node, "mesh");
        if (!mesh) return tl::unexpected(mesh.error());
        // Scaled to nothing is glTF's way not to show something.
        const bool shows = transform.axes != std::array<Vector3d, 3>{};
        if (*mesh && shows)
            if (auto ok = add_mesh(reading, *node, **mesh, transform); !ok) return ok;
        const auto children = nodes_in(*node, "children");
        if (!children) return tl::unexpected(children.error());
        if (auto ok = show(*children, transform); !ok) return ok;
    }
    return {};
}

}  // namespace

Result<Mesh> read_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder,
                       const MeshReadOptions& options, MeshFindings* findings) {
    const auto& limits = options.limits;
    auto file = open_gltf(bytes, folder);
    if (!file) return tl::unexpected(file.error());
    Reading reading{std::move(*file), limits};
    if (auto ok = add_scene(reading); !ok) return tl::unexpected(ok.error());
    Mesh& mesh = reading.mesh;
    if (!reading.any_colours) mesh.colours.clear();
    if (!reading.any_normals) mesh.normals.clear();
    if (!reading.any_texcoords) mesh.texcoords.clear();
    for (std::size_t i = 0; i < reading.texture.images.size(); ++i) reading.texture.parts.push_back({{}, i, {}});
    if (reading.any_without_image) reading.texture.parts.emplace_back();
    if (findings) findings->texture = std::move(reading.texture);
    return std::move(mesh);
}

}  // namespace htvm
