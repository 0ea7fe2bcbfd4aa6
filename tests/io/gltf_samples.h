// A small glTF file that tests of its readers change.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/bytes.h"
#include "gtest/gtest.h"
#include "io/gltf.h"
#include "io/mesh_samples.h"

namespace htvm::samples {

using nlohmann::json;

inline std::vector<std::uint8_t> glb(const json& root, const std::vector<std::uint8_t>& binary = {}) {
    auto text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    internal::ByteWriter out;
    out.bytes(bytes_of("glTF"));
    out.u32(2);
    out.u32(static_cast<std::uint32_t>(12 + 8 + text.size() + (binary.empty() ? 0 : 8 + binary.size())));
    out.u32(static_cast<std::uint32_t>(text.size()));
    out.bytes(bytes_of("JSON"));
    out.bytes(bytes_of(text));
    if (!binary.empty()) {
        out.u32(static_cast<std::uint32_t>(binary.size()));
        out.bytes(bytes_of(std::string_view("BIN\0", 4)));
        out.bytes(binary);
    }
    return out.take();
}

inline std::vector<std::uint8_t> floats(std::initializer_list<float> values) {
    internal::ByteWriter out;
    for (const float value : values) out.u32(std::bit_cast<std::uint32_t>(value));
    return out.take();
}

// A triangle of four vertices (one is left over), on the node 0; tests change what they are about.
struct GltfSample {
    std::vector<std::uint8_t> binary = floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 6, 7});
    json root = json::parse(R"({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 3}],
        "buffers": [{"byteLength": 52}]})");
    GltfSample() { binary.insert(binary.end(), {0, 1, 2, 0}); }
    json& primitive() { return root["meshes"][0]["primitives"][0]; }
    // A view of bytes behind the others.
    std::size_t add_view(std::span<const std::uint8_t> bytes) {
        binary.resize((binary.size() + 3) / 4 * 4);
        root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
        binary.insert(binary.end(), bytes.begin(), bytes.end());
        root["buffers"][0]["byteLength"] = binary.size();
        return root["bufferViews"].size() - 1;
    }
    std::size_t add_accessor(const std::vector<std::uint8_t>& bytes, int component, const char* type, int count) {
        const auto view = add_view(bytes);
        root["accessors"].push_back(
            {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
        return root["accessors"].size() - 1;
    }
    // An image inside, and its texture; its bytes are those of no picture.
    std::size_t add_texture(std::string_view image = "image") {
        root["images"].push_back({{"bufferView", add_view(bytes_of(image))}});
        root["textures"].push_back({{"source", root["images"].size() - 1}});
        return root["textures"].size() - 1;
    }
    // A material for the primitive.
    json& material(const char* text) {
        root["materials"].push_back(json::parse(text));
        primitive()["material"] = root["materials"].size() - 1;
        return root["materials"].back();
    }
    // An attribute of the four vertices, and its accessor.
    json& add(const char* name, const std::vector<std::uint8_t>& bytes, int component, const char* type) {
        add_accessor(bytes, component, type, 4);
        primitive()["attributes"][name] = root["accessors"].size() - 1;
        return root["accessors"].back();
    }
    Result<Mesh> read(const MeshLimits& limits = {}, MeshFindings* findings = nullptr) const {
        return read_gltf(glb(root, binary), {}, {limits}, findings);
    }
    MeshFindings findings() const {
        MeshFindings out;
        const auto read_back = read({}, &out);
        EXPECT_TRUE(read_back) << read_back.error().message;
        return out;
    }
    Mesh mesh() const {
        const auto read_back = read();
        EXPECT_TRUE(read_back) << read_back.error().message;
        return read_back.value_or(Mesh());
    }
    Error error() const {
        const auto read_back = read();
        EXPECT_FALSE(read_back);
        return read_back ? Error{} : read_back.error();
    }
};

inline const std::vector<Vector3f> sample_positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 6, 7}};

}  // namespace htvm::samples
