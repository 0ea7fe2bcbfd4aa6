#include "io/gltf_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "core/geometry.h"
#include "io/gltf_accessor.h"
#include "io/mesh_check.h"

namespace htvm::internal {

Vector3d GltfTransform::turned(const Vector3d& v) const { return axes[0] * v[0] + axes[1] * v[1] + axes[2] * v[2]; }
Vector3d GltfTransform::moved(const Vector3d& p) const { return is_identity ? p : turned(p) + origin; }
bool GltfTransform::is_mirror() const { return dot(cross(axes[0], axes[1]), axes[2]) < 0; }

namespace {

using nlohmann::json;

constexpr std::uint64_t most_shown = std::uint64_t{1} << 20;  // meshes, of all nodes and instances

tl::unexpected<Error> not_readable(const std::string& why) { return gltf_not_readable(why); }

// ---- Transforms -----------------------------------------------------------------------------------------------------

// First b, then a.
GltfTransform composed(const GltfTransform& a, const GltfTransform& b) {
    if (a.is_identity) return b;
    if (b.is_identity) return a;
    return {{a.turned(b.axes[0]), a.turned(b.axes[1]), a.turned(b.axes[2])}, a.moved(b.origin), false};
}

GltfTransform with_identity_known(GltfTransform transform) {
    const GltfTransform identity;
    transform.is_identity = transform.axes == identity.axes && transform.origin == identity.origin;
    return transform;
}

// Columns after columns.
GltfTransform of_matrix(const std::array<double, 16>& m) {
    GltfTransform out;
    for (std::size_t i = 0; i < 3; ++i) out.axes[i] = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
    out.origin = {m[12], m[13], m[14]};
    return with_identity_known(out);
}

// Scaled, turned by the quaternion x, y, z, w, moved. A quaternion that is rounded (as bytes) is made one of length 1.
GltfTransform of_parts(const Vector3d& move, std::array<double, 4> turn, const Vector3d& s) {
    auto& [x, y, z, w] = turn;
    const double size = std::sqrt(x * x + y * y + z * z + w * w);
    if (size > 0 && std::isfinite(size) && std::abs(size - 1) > 1e-6)
        for (auto& c : turn) c /= size;
    GltfTransform out;
    out.axes[0] = Vector3d{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * s[0];
    out.axes[1] = Vector3d{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * s[1];
    out.axes[2] = Vector3d{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * s[2];
    out.origin = move;
    return with_identity_known(out);
}

// The node's own, relative to its parent.
Result<GltfTransform> transform_of(const json& node) {
    if (gltf_member(node, "matrix")) {
        const auto m = gltf_numbers<16>(node, "matrix", {});
        if (!m) return tl::unexpected(m.error());
        return of_matrix(*m);
    }
    const auto move = gltf_numbers<3>(node, "translation", {0, 0, 0});
    const auto turn = gltf_numbers<4>(node, "rotation", {0, 0, 0, 1});
    const auto scale = gltf_numbers<3>(node, "scale", {1, 1, 1});
    if (!move) return tl::unexpected(move.error());
    if (!turn) return tl::unexpected(turn.error());
    if (!scale) return tl::unexpected(scale.error());
    return of_parts(*move, *turn, *scale);
}

// ---- Nodes ----------------------------------------------------------------------------------------------------------

// The numbers in a list of nodes, such as children.
Result<std::vector<std::uint64_t>> nodes_in(const json& object, const char* name) {
    std::vector<std::uint64_t> out;
    const auto* list = gltf_member(object, name);
    if (!list) return out;
    if (!list->is_array()) return not_readable(std::string("\"") + name + "\" is no list");
    for (const auto& node : *list) {
        if (!node.is_number_unsigned())
            return not_readable(std::string("\"") + name + "\" does not list numbers of nodes");
        out.push_back(node.get<std::uint64_t>());
    }
    return out;
}

std::size_t count_in(const GltfFile& file, const char* list) {
    const auto* items = gltf_member(file.root, list);
    return items && items->is_array() ? items->size() : 0;
}

// The nodes that are nobody's child.
Result<std::vector<std::uint64_t>> top_nodes(const GltfFile& file) {
    const std::size_t count = count_in(file, "nodes");
    std::vector<bool> is_child(count);
    for (std::size_t n = 0; n < count; ++n) {
        const auto node = gltf_item(file, "nodes", n);
        if (!node) return tl::unexpected(node.error());
        const auto children = nodes_in(**node, "children");
        if (!children) return tl::unexpected(children.error());
        for (const auto child : *children)
            if (child < count) is_child[static_cast<std::size_t>(child)] = true;
    }
    std::vector<std::uint64_t> out;
    for (std::size_t n = 0; n < count; ++n)
        if (!is_child[n]) out.push_back(n);
    return out;
}

// The nodes that are shown first: those of the scene; without one, those at the top.
Result<std::vector<std::uint64_t>> roots_of(const GltfFile& file, MeshFindings* findings) {
    const auto scene = gltf_number(file.root, "scene", 0);
    if (!scene) return tl::unexpected(scene.error());
    const auto scenes = count_in(file, "scenes");
    if (scenes == 0) return top_nodes(file);
    const auto shown = gltf_item(file, "scenes", *scene);
    if (!shown) return tl::unexpected(shown.error());
    if (scenes > 1)
        remark(findings, "scenes", "of its " + std::to_string(scenes) + " scenes the one that it shows first is taken");
    return nodes_in(**shown, "nodes");
}

struct PlacedNode {
    const json* node;
    GltfTransform transform;
    std::uint64_t number;
};

// Calls take(PlacedNode) for the nodes and what is below them, in order; false leaves out what is below.
template <class Take>
Result<void> walk(const GltfFile& file, const std::vector<std::uint64_t>& roots, Take take) {
    std::vector<PlacedNode> next;
    std::vector<bool> met;
    const auto show = [&](const std::vector<std::uint64_t>& numbers, const GltfTransform& parent) -> Result<void> {
        for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
            const auto node = gltf_item(file, "nodes", *number);
            if (!node) return tl::unexpected(node.error());
            const auto place = static_cast<std::size_t>(*number);
            if (place >= met.size()) met.resize(place + 1);
            if (met[place])
                return not_readable("node " + std::to_string(place) + " has two parents, or is part of a circle");
            met[place] = true;
            next.push_back({*node, parent, *number});
        }
        return {};
    };
    if (auto ok = show(roots, {}); !ok) return ok;
    while (!next.empty()) {
        auto placed = next.back();
        next.pop_back();
        const auto own = transform_of(*placed.node);
        if (!own) return tl::unexpected(own.error());
        placed.transform = composed(placed.transform, *own);
        const Result<bool> goes_on = take(placed);
        if (!goes_on) return tl::unexpected(goes_on.error());
        if (!*goes_on) continue;
        const auto children = nodes_in(*placed.node, "children");
        if (!children) return tl::unexpected(children.error());
        if (auto ok = show(*children, placed.transform); !ok) return ok;
    }
    return {};
}

// ---- Skeletons ------------------------------------------------------------------------------------------------------

using NodeTransforms = std::map<std::uint64_t, GltfTransform>;

Result<NodeTransforms> transforms_of_all(const GltfFile& file) {
    NodeTransforms out;
    const auto roots = top_nodes(file);
    if (!roots) return tl::unexpected(roots.error());
    const auto walked = walk(file, *roots, [&](const PlacedNode& placed) -> Result<bool> {
        out.emplace(placed.number, placed.transform);
        return true;
    });
    if (!walked) return tl::unexpected(walked.error());
    return out;
}

bool are_near(const GltfTransform& a, const GltfTransform& b, double far) {
    constexpr double share = 1e-4;
    double scale = 0, turn = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        scale = std::max(scale, length(a.axes[i]));
        turn = std::max(turn, length(a.axes[i] - b.axes[i]));
    }
    return turn <= share * scale && length(a.origin - b.origin) <= share * far;
}

// How a skeleton moves its mesh, if it moves all of it alike.
Result<std::optional<GltfTransform>> rigid_motion(GltfFile& file, std::uint64_t index, const NodeTransforms& nodes) {
    const auto skin = gltf_item(file, "skins", index);
    if (!skin) return tl::unexpected(skin.error());
    const auto joints = nodes_in(**skin, "joints");
    if (!joints) return tl::unexpected(joints.error());
    const auto bind = gltf_index(**skin, "inverseBindMatrices");
    if (!bind) return tl::unexpected(bind.error());
    std::optional<GltfAccessor> matrices;
    if (*bind) {
        auto opened = open_accessor(file, **bind);
        if (!opened) return tl::unexpected(opened.error());
        if (opened->components != 16 || opened->count < joints->size())
            return not_readable("a skin has no matrix for each of its joints");
        matrices = std::move(*opened);
    }
    std::optional<GltfTransform> first;
    double far = 0;  // how large the skeleton is
    std::optional<Vector3d> first_joint;
    for (std::size_t j = 0; j < joints->size(); ++j) {
        const auto joint = nodes.find((*joints)[j]);
        if (joint == nodes.end()) return not_readable("a skin has a joint that is no node");
        GltfTransform unbound;
        if (matrices) {
            std::array<double, 16> m{};
            for (std::size_t i = 0; i < 16; ++i) m[i] = matrices->number(j, i);
            unbound = of_matrix(m);
        }
        const auto motion = composed(joint->second, unbound);
        if (!first_joint) first_joint = joint->second.origin;
        far = std::max({far, length(joint->second.origin - *first_joint), length(joint->second.origin) * 0.01});
        if (!first) first = motion;
        if (!are_near(*first, motion, far)) return std::optional<GltfTransform>();
    }
    return first;
}

Result<GltfTransform> transform_by_skin(GltfFile& file, std::uint64_t skin, std::optional<NodeTransforms>& nodes,
                                        std::map<std::uint64_t, GltfTransform>& known) {
    if (const auto found = known.find(skin); found != known.end()) return found->second;
    if (!nodes) {
        auto all = transforms_of_all(file);
        if (!all) return tl::unexpected(all.error());
        nodes = std::move(*all);
    }
    const auto motion = rigid_motion(file, skin, *nodes);
    if (!motion) return tl::unexpected(motion.error());
    if (!*motion)
        return fail(ErrorKind::unsupported,
                    "the glTF has a mesh that a skeleton moves (skin), which is not read; export "
                    "it with the pose applied");
    return known.emplace(skin, **motion).first->second;
}

// ---- What nodes show ------------------------------------------------------------------------------------------------

bool is_hidden(const json& node) {
    const auto* extension = gltf_extension(node, "KHR_node_visibility");
    const auto* visible = extension ? gltf_member(*extension, "visible") : nullptr;
    return visible && visible->is_boolean() && !visible->get<bool>();
}

// Where the instances of a node's mesh are, relative to the node: one that is not moved, without the extension.
Result<std::vector<GltfTransform>> instances_of(GltfFile& file, const json& node) {
    const auto* extension = gltf_extension(node, "EXT_mesh_gpu_instancing");
    if (!extension) return std::vector<GltfTransform>(1);
    const auto* attributes = gltf_member(*extension, "attributes");
    std::array<std::optional<GltfAccessor>, 3> rows;
    constexpr std::array names = {"TRANSLATION", "ROTATION", "SCALE"};
    std::optional<std::uint64_t> count;
    for (std::size_t i = 0; attributes && i < names.size(); ++i) {
        const auto index = gltf_index(*attributes, names[i]);
        if (!index) return tl::unexpected(index.error());
        if (!*index) continue;
        auto opened = open_accessor(file, **index);
        if (!opened) return tl::unexpected(opened.error());
        if (opened->components != (i == 1 ? 4u : 3u))
            return not_readable(std::string("the ") + names[i] + " of instances has " +
                                std::to_string(opened->components) + " numbers each");
        count = std::min(count.value_or(opened->count), opened->count);
        rows[i] = std::move(*opened);
    }
    if (!count) return std::vector<GltfTransform>(1);
    if (auto ok = check_count(*count, most_shown, "instances"); !ok) return tl::unexpected(ok.error());
    std::vector<GltfTransform> out;
    const auto number = [&](std::size_t part, std::uint64_t row, std::size_t column, double otherwise) {
        return rows[part] ? rows[part]->number(row, column) : otherwise;
    };
    for (std::uint64_t n = 0; n < *count; ++n)
        out.push_back(of_parts({number(0, n, 0, 0), number(0, n, 1, 0), number(0, n, 2, 0)},
                               {number(1, n, 0, 0), number(1, n, 1, 0), number(1, n, 2, 0), number(1, n, 3, 1)},
                               {number(2, n, 0, 1), number(2, n, 1, 1), number(2, n, 2, 1)}));
    return out;
}

bool any_weight(const json& object) {
    const auto* weights = gltf_member(object, "weights");
    if (!weights || !weights->is_array()) return false;
    return std::any_of(weights->begin(), weights->end(),
                       [](const json& weight) { return !weight.is_number() || weight.get<double>() != 0; });
}

Result<void> check_shape(const GltfFile& file, const json& node, std::uint64_t index) {
    const auto mesh = gltf_item(file, "meshes", index);
    if (!mesh) return tl::unexpected(mesh.error());
    if (gltf_member(node, "weights") ? any_weight(node) : any_weight(**mesh))
        return fail(ErrorKind::unsupported,
                    "the glTF has a mesh that morph targets change, which are not read; export "
                    "it with the shape applied");
    return {};
}

void tell_of_animations(const GltfFile& file, MeshFindings* findings) {
    const auto* animations = gltf_member(file.root, "animations");
    if (!animations || !animations->is_array() || animations->empty()) return;
    remark(findings, "animation", "it is animated, and taken as it is at rest");
}

}  // namespace

Result<std::vector<GltfShownMesh>> gltf_shown_meshes(GltfFile& file, MeshFindings* findings) {
    std::vector<GltfShownMesh> out;
    tell_of_animations(file, findings);
    if (count_in(file, "nodes") == 0) {  // a library of meshes
        for (std::size_t m = 0; m < count_in(file, "meshes"); ++m) out.push_back({m, {}});
        return out;
    }
    const auto roots = roots_of(file, findings);
    if (!roots) return tl::unexpected(roots.error());
    std::optional<NodeTransforms> nodes;
    std::map<std::uint64_t, GltfTransform> by_skin;
    const auto walked = walk(file, *roots, [&](const PlacedNode& placed) -> Result<bool> {
        const auto& node = *placed.node;
        if (is_hidden(node)) return false;
        const auto mesh = gltf_index(node, "mesh");
        const auto skin = gltf_index(node, "skin");
        if (!mesh) return tl::unexpected(mesh.error());
        if (!skin) return tl::unexpected(skin.error());
        // Scaled to nothing is glTF's way not to show something.
        if (!*mesh || placed.transform.axes == std::array<Vector3d, 3>{}) return true;
        if (auto ok = check_shape(file, node, **mesh); !ok) return tl::unexpected(ok.error());
        auto transform = placed.transform;
        if (*skin) {
            const auto moved = transform_by_skin(file, **skin, nodes, by_skin);
            if (!moved) return tl::unexpected(moved.error());
            transform = *moved;
        }
        const auto instances = instances_of(file, node);
        if (!instances) return tl::unexpected(instances.error());
        for (const auto& instance : *instances)
            if (instance.axes != std::array<Vector3d, 3>{}) out.push_back({**mesh, composed(transform, instance)});
        if (auto ok = check_count(out.size(), most_shown, "meshes in it"); !ok) return tl::unexpected(ok.error());
        return true;
    });
    if (!walked) return tl::unexpected(walked.error());
    return out;
}

}  // namespace htvm::internal
