#include "io/gltf_buffer.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "core/bytes.h"
#include "core/srgb.h"
#include "io/gltf_accessor.h"

namespace htvm::internal {
namespace {

using nlohmann::json;

enum class Target { none = 0, vertices = 34962, triangles = 34963 };

constexpr int triangle_list = 4, point_list = 0;                  // modes of primitives
constexpr std::size_t captured_colours = 0, without_colours = 1;  // numbers of materials; then one for each image

json materials(std::size_t images) {
    const json surface = {{"metallicFactor", 0}, {"roughnessFactor", 0.9}};
    const json captured = {{"name", "captured colours"},
                           {"pbrMetallicRoughness", surface},
                           {"extensions", {{"KHR_materials_unlit", json::object()}}},
                           {"doubleSided", true}};
    const json without = {{"name", "without colours"}, {"pbrMetallicRoughness", surface}, {"doubleSided", true}};
    json out = json::array({captured, without});
    for (std::size_t image = 0; image < images; ++image) {
        auto textured = captured;
        textured["name"] = "captured texture";
        textured["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", image}};
        out.push_back(std::move(textured));
    }
    return out;
}

void put(GltfBuffer& buffer, std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) buffer.bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void put(GltfBuffer& buffer, float value) { put(buffer, std::bit_cast<std::uint32_t>(value), 4); }

// Adds an accessor of everything in the buffer from `begin` on, which is a multiple of four bytes long.
std::size_t add_accessor(GltfBuffer& buffer, std::uint64_t begin, Target target, GltfComponent component,
                         const char* type, std::size_t count) {
    json view = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", buffer.size() - begin}};
    if (target != Target::none) view["target"] = static_cast<int>(target);
    buffer.views.push_back(std::move(view));
    buffer.accessors.push_back({{"bufferView", buffer.views.size() - 1},
                                {"componentType", static_cast<int>(component)},
                                {"count", count},
                                {"type", type}});
    return buffer.accessors.size() - 1;
}

template <std::size_t N>
std::size_t add_vectors(GltfBuffer& buffer, std::span<const std::array<float, N>> vectors, Target target) {
    const auto begin = buffer.size();
    for (const auto& vector : vectors)
        for (const float c : vector) put(buffer, c);
    return add_accessor(buffer, begin, target, GltfComponent::f32, N == 2 ? "VEC2" : "VEC3", vectors.size());
}

std::size_t add_positions(GltfBuffer& buffer, std::span<const Vector3f> positions) {
    const auto accessor = add_vectors(buffer, positions, Target::vertices);
    Vector3f low = positions[0], high = positions[0];
    for (const auto& p : positions)
        for (std::size_t i = 0; i < 3; ++i) {
            low[i] = std::min(low[i], p[i]);
            high[i] = std::max(high[i], p[i]);
        }
    buffer.accessors[accessor]["min"] = low;
    buffer.accessors[accessor]["max"] = high;
    return accessor;
}

// 16 bits of light, in which dark levels stay apart; with an opaque alpha, so that rows begin at multiples of four.
std::size_t add_colours(GltfBuffer& buffer, std::span<const Colour> colours) {
    const auto begin = buffer.size();
    for (const auto& colour : colours) {
        for (const auto level : colour) put(buffer, static_cast<std::uint64_t>(light_of(level) * 65535 + 0.5f), 2);
        put(buffer, 65535, 2);
    }
    const auto accessor = add_accessor(buffer, begin, Target::vertices, GltfComponent::u16, "VEC4", colours.size());
    buffer.accessors[accessor]["normalized"] = true;
    return accessor;
}

std::size_t add_triangles(GltfBuffer& buffer, std::span<const Triangle> triangles, GltfComponent component) {
    const auto begin = buffer.size();
    for (const auto& triangle : triangles)
        for (const auto index : triangle) put(buffer, index, component == GltfComponent::u16 ? 2 : 4);
    const auto accessor = add_accessor(buffer, begin, Target::triangles, component, "SCALAR", 3 * triangles.size());
    while (buffer.size() % 4 != 0) buffer.bytes.push_back(0);
    return accessor;
}

std::size_t add_texcoords(GltfBuffer& buffer, std::span<const Vector2f> texcoords) {
    std::vector<Vector2f> downwards(texcoords.begin(), texcoords.end());
    for (auto& t : downwards) t[1] = 1 - t[1];
    return add_vectors<2>(buffer, downwards, Target::vertices);
}

}  // namespace

std::size_t add_image(GltfBuffer& buffer, std::span<const std::uint8_t> file) {
    const bool png = file.size() > 1 && file[1] == 'P';
    buffer.views.push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", file.size()}});
    buffer.images.push_back({{"bufferView", buffer.views.size() - 1}, {"mimeType", png ? "image/png" : "image/jpeg"}});
    buffer.bytes.insert(buffer.bytes.end(), file.begin(), file.end());
    while (buffer.size() % 4 != 0) buffer.bytes.push_back(0);
    return buffer.images.size() - 1;
}

std::size_t add_mesh(GltfBuffer& buffer, const Mesh& mesh, GltfTopology& topology, std::optional<std::size_t> image,
                     GltfTriangles triangles) {
    // The largest number of two bytes is none that an index may have.
    const bool fits = triangles == GltfTriangles::of_one_frame && mesh.positions.size() <= 0xFFFF;
    if (!topology.known || topology.triangles != mesh.triangles || topology.texcoords != mesh.texcoords) {
        topology = {mesh.triangles, mesh.texcoords, 0, 0, true};
        if (!mesh.triangles.empty())
            topology.triangle_accessor =
                add_triangles(buffer, mesh.triangles, fits ? GltfComponent::u16 : GltfComponent::u32);
        if (!mesh.texcoords.empty()) topology.texcoord_accessor = add_texcoords(buffer, mesh.texcoords);
    }
    json attributes = {{"POSITION", add_positions(buffer, mesh.positions)}};
    if (!mesh.normals.empty()) attributes["NORMAL"] = add_vectors<3>(buffer, mesh.normals, Target::vertices);
    if (!mesh.colours.empty() && !image) attributes["COLOR_0"] = add_colours(buffer, mesh.colours);
    if (!mesh.texcoords.empty()) attributes["TEXCOORD_0"] = topology.texcoord_accessor;
    const auto material = image                  ? without_colours + 1 + *image
                          : mesh.colours.empty() ? without_colours
                                                 : captured_colours;
    json primitive = {{"attributes", std::move(attributes)},
                      {"mode", mesh.triangles.empty() ? point_list : triangle_list},
                      {"material", material}};
    if (!mesh.triangles.empty()) primitive["indices"] = topology.triangle_accessor;
    json entry = json::object();
    entry["primitives"].push_back(std::move(primitive));
    buffer.meshes.push_back(std::move(entry));
    return buffer.meshes.size() - 1;
}

std::size_t add_numbers(GltfBuffer& buffer, std::span<const float> numbers) {
    const auto begin = buffer.size();
    for (const float number : numbers) put(buffer, number);
    const auto accessor = add_accessor(buffer, begin, Target::none, GltfComponent::f32, "SCALAR", numbers.size());
    const auto [low, high] = std::minmax_element(numbers.begin(), numbers.end());
    buffer.accessors[accessor]["min"].push_back(*low);
    buffer.accessors[accessor]["max"].push_back(*high);
    return accessor;
}

std::size_t add_rows(GltfBuffer& buffer, std::span<const Vector3f> rows) {
    return add_vectors(buffer, rows, Target::none);
}

std::vector<std::uint8_t> glb_front(json root, const GltfBuffer& buffer) {
    if (!buffer.meshes.empty()) {
        root["buffers"].push_back({{"byteLength", buffer.size()}});
        root["bufferViews"] = buffer.views;
        root["accessors"] = buffer.accessors;
        root["meshes"] = buffer.meshes;
        root["materials"] = materials(buffer.images.size());
        if (!buffer.images.empty()) {
            root["images"] = buffer.images;
            for (std::size_t image = 0; image < buffer.images.size(); ++image)
                root["textures"].push_back({{"source", image}});
        }
        root["extensionsUsed"].push_back("KHR_materials_unlit");
    }
    // Names and texts may be any bytes.
    std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const bool binary = !buffer.meshes.empty();
    const auto length = 12 + 8 + text.size() + (binary ? 8 + buffer.size() : 0);
    ByteWriter out;
    out.u32(glb_magic);
    out.u32(2);
    out.u32(static_cast<std::uint32_t>(length));
    out.u32(static_cast<std::uint32_t>(text.size()));
    out.u32(glb_json_chunk);
    out.bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    if (binary) {
        out.u32(static_cast<std::uint32_t>(buffer.size()));
        out.u32(glb_binary_chunk);
    }
    return out.take();
}

}  // namespace htvm::internal
