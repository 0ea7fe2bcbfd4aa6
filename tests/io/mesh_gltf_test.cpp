#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "core/bytes.h"
#include "gmock/gmock.h"
#include "io/gltf.h"
#include "io/gltf_animation.h"
#include "io/gltf_samples.h"
#include "io/mesh_file.h"
#include "io/mesh_samples.h"

namespace htvm {
namespace {

using nlohmann::json;
using samples::bytes_of;
using samples::floats;
using samples::glb;
using samples::random_mesh;
using samples::sample_positions;
using testing::HasSubstr;

using Sample = samples::GltfSample;

// ---- Writing, and reading back --------------------------------------------------------------------------------------

TEST(GltfWriting, MeshesReadBackAsTheyWere) {
    for (const bool colours : {false, true})
        for (const bool normals : {false, true})
            for (const bool texcoords : {false, true}) {
                const Mesh mesh = random_mesh(5, 40, 70, {colours, normals, texcoords});
                const auto bytes = write_gltf(mesh);
                ASSERT_TRUE(bytes) << bytes.error().message;
                const auto again = read_gltf(*bytes, {});
                ASSERT_TRUE(again) << again.error().message;
                EXPECT_EQ(again->positions, mesh.positions);
                EXPECT_EQ(again->triangles, mesh.triangles);
                EXPECT_EQ(again->colours, mesh.colours);
                EXPECT_EQ(again->normals, mesh.normals);
                ASSERT_EQ(again->texcoords.size(), mesh.texcoords.size());
                for (std::size_t v = 0; v < mesh.texcoords.size(); ++v) {
                    EXPECT_EQ(again->texcoords[v][0], mesh.texcoords[v][0]);
                    EXPECT_NEAR(again->texcoords[v][1], mesh.texcoords[v][1], 2e-7);
                }
            }
}

TEST(GltfWriting, EveryLevelOfAColourComesBack) {
    Mesh mesh;
    for (int level = 0; level < 256; ++level) {
        const auto c = static_cast<std::uint8_t>(level);
        mesh.positions.push_back({static_cast<float>(level), 0, 0});
        mesh.colours.push_back({c, static_cast<std::uint8_t>(255 - c), c});
    }
    const auto again = read_gltf(*write_gltf(mesh), {});
    ASSERT_TRUE(again);
    EXPECT_EQ(again->colours, mesh.colours);
}

TEST(GltfWriting, MeshesWithoutVerticesOrTrianglesAreFiles) {
    EXPECT_TRUE(read_gltf(*write_gltf(Mesh()), {})->positions.empty());
    Mesh points;
    points.positions = {{1, 2, 3}, {4, 5, 6}};
    const auto again = read_gltf(*write_gltf(points), {});
    ASSERT_TRUE(again);
    EXPECT_EQ(again->positions, points.positions);
    EXPECT_TRUE(again->triangles.empty());
    points.triangles = {{0, 1, 2}};
    EXPECT_FALSE(write_gltf(points));
}

// ---- Reading --------------------------------------------------------------------------------------------------------

TEST(GltfReading, ATriangleAsItIs) {
    const Mesh mesh = Sample().mesh();
    EXPECT_EQ(mesh.positions, sample_positions);
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
    EXPECT_TRUE(mesh.colours.empty() && mesh.normals.empty() && mesh.texcoords.empty());
}

TEST(GltfReading, ColoursAreLightInAnyOfTheirTypes) {
    const std::vector<Colour> expected{{188, 0, 255}, {188, 0, 255}, {188, 0, 255}, {188, 0, 255}};
    Sample as_floats, as_shorts, as_bytes;
    as_floats.add("COLOR_0", floats({.5f, 0, 1, .5f, 0, 1, .5f, 0, 1, .5f, 0, 1}), 5126, "VEC3");
    EXPECT_EQ(as_floats.mesh().colours, expected);
    std::vector<std::uint8_t> shorts, bytes;
    for (int v = 0; v < 4; ++v) {
        shorts.insert(shorts.end(), {0, 128, 0, 0, 255, 255, 0, 0});  // alpha 0 does not matter
        bytes.insert(bytes.end(), {128, 0, 255, 0});
    }
    as_shorts.add("COLOR_0", shorts, 5123, "VEC4")["normalized"] = true;
    EXPECT_EQ(as_shorts.mesh().colours, expected);
    as_bytes.add("COLOR_0", bytes, 5121, "VEC4")["normalized"] = true;
    EXPECT_EQ(as_bytes.mesh().colours, expected);
}

TEST(GltfReading, TheMaterialsColourMultipliesThatOfTheVertices) {
    Sample sample;
    sample.add("COLOR_0", floats({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}), 5126, "VEC3");
    sample.root["materials"] = json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 0, 1]}}])");
    sample.primitive()["material"] = 0;
    EXPECT_EQ(sample.mesh().colours[0], (Colour{188, 255, 0}));
}

TEST(GltfReading, TextureCoordinatesBeginAtTheBottom) {
    Sample sample;
    sample.add("TEXCOORD_0", floats({0, 0, 1, .25f, .5f, 1, 0, 2}), 5126, "VEC2");
    EXPECT_EQ(sample.mesh().texcoords, (std::vector<Vector2f>{{0, 1}, {1, .75f}, {.5f, 0}, {0, -1}}));
}

TEST(GltfReading, IntegersMayStandForPositionsAndForShares) {
    Sample sample;
    std::vector<std::uint8_t> rows;
    for (const int x : {0, 127, -127, -128}) rows.insert(rows.end(), {static_cast<std::uint8_t>(x), 1, 2, 99});
    json& accessor = sample.add("POSITION", rows, 5120, "VEC3");
    sample.root["bufferViews"].back()["byteStride"] = 4;
    sample.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    EXPECT_EQ(sample.mesh().positions, (std::vector<Vector3f>{{0, 1, 2}, {127, 1, 2}, {-127, 1, 2}, {-128, 1, 2}}));
    accessor["normalized"] = true;
    const auto positions = sample.mesh().positions;
    EXPECT_EQ(positions[1][0], 1);
    EXPECT_EQ(positions[2][0], -1);
    EXPECT_EQ(positions[3][0], -1);
}

TEST(GltfReading, RowsMayBeInterleaved) {
    Sample sample;
    json& accessor = sample.add("POSITION", floats({0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9, 5, 6, 7}), 5126, "VEC3");
    sample.root["bufferViews"].back()["byteStride"] = 16;
    EXPECT_EQ(sample.mesh().positions, sample_positions);
    accessor["byteOffset"] = 4;  // the last row would end behind the view
    EXPECT_THAT(sample.error().message, HasSubstr("goes beyond its view"));
}

TEST(GltfReading, StripsFansPointsAndTrianglesWithoutIndices) {
    Sample sample;
    sample.primitive().erase("indices");
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{0, 1, 2}}));
    sample.primitive()["mode"] = 5;
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
    sample.primitive()["mode"] = 6;
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{1, 2, 0}, {2, 3, 0}}));
    sample.primitive()["mode"] = 0;
    EXPECT_EQ(sample.mesh().positions.size(), 4u);
    EXPECT_TRUE(sample.mesh().triangles.empty());
    sample.primitive()["mode"] = 1;
    EXPECT_TRUE(sample.mesh().positions.empty()) << "lines are passed over";
    sample.primitive()["mode"] = 7;
    EXPECT_THAT(sample.error().message, HasSubstr("unknown mode 7"));
}

TEST(GltfReading, TransformsOfNodesAreApplied) {
    Sample sample;
    sample.add("NORMAL", floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}), 5126, "VEC3");
    // A quarter turn about z, then twice as wide in x; all of it moved by the parent.
    sample.root["nodes"] = json::parse(R"([{"children": [1], "translation": [10, 20, 30], "scale": [2, 1, 1]},
        {"mesh": 0, "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476]}])");
    const Mesh mesh = sample.mesh();
    const std::vector<Vector3f> positions{{10, 20, 30}, {10, 21, 30}, {8, 20, 30}, {-2, 25, 37}};
    const std::vector<Vector3f> normals{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, 0}};
    for (std::size_t v = 0; v < 4; ++v)
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_NEAR(mesh.positions[v][i], positions[v][i], 1e-5) << v;
            EXPECT_NEAR(mesh.normals[v][i], normals[v][i], 1e-6) << v;
        }
    EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
}

TEST(GltfReading, AMirrorTurnsTrianglesRound) {
    Sample sample;
    sample.root["nodes"][0]["matrix"] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 0, 0, 1};
    const Mesh mesh = sample.mesh();
    EXPECT_EQ(mesh.positions[1], (Vector3f{3, 0, 0}));
    EXPECT_EQ(mesh.triangles[0], (Triangle{0, 2, 1}));
}

TEST(GltfReading, ANodeThatIsScaledToNothingIsHidden) {
    Sample sample;
    sample.root["nodes"][0]["scale"] = {0, 0, 0};
    EXPECT_TRUE(sample.mesh().positions.empty());
}

TEST(GltfReading, PrimitivesAndNodesAreJoinedAndShareTheirVertices) {
    Sample sample;
    auto& primitives = sample.root["meshes"][0]["primitives"];
    primitives.push_back(primitives[0]);  // the same vertices again
    sample.root["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, 1}}});
    sample.root["scenes"][0]["nodes"] = {0, 1};
    const Mesh mesh = sample.mesh();
    ASSERT_EQ(mesh.positions.size(), 8u);
    EXPECT_EQ(mesh.positions[4], (Vector3f{0, 0, 1}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}, {4, 5, 6}, {4, 5, 6}}));
}

TEST(GltfReading, WhatAPrimitiveLacksIsWhiteOrZero) {
    Sample sample;
    auto& primitives = sample.root["meshes"][0]["primitives"];
    primitives.push_back(primitives[0]);
    sample.add("COLOR_0", floats({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), 5126, "VEC3");
    sample.add("NORMAL", floats({1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}), 5126, "VEC3");
    const Mesh mesh = sample.mesh();
    ASSERT_EQ(mesh.positions.size(), 8u);
    EXPECT_EQ(mesh.colours[0], (Colour{0, 0, 0}));
    EXPECT_EQ(mesh.colours[7], (Colour{255, 255, 255}));
    EXPECT_EQ(mesh.normals[0], (Vector3f{1, 0, 0}));
    EXPECT_EQ(mesh.normals[7], (Vector3f{0, 0, 0}));
}

TEST(GltfReading, OnlyTheShownSceneIsRead) {
    Sample sample;
    sample.root["scenes"] = json::parse(R"([{"nodes": [0]}, {}])");
    sample.root["scene"] = 1;
    EXPECT_TRUE(sample.mesh().positions.empty());
    sample.root.erase("scene");
    sample.root.erase("scenes");
    EXPECT_EQ(sample.mesh().positions, sample_positions) << "without scenes, all nodes";
}

// ---- Files that are wrong or hostile --------------------------------------------------------------------------------

TEST(GltfReading, WhatIsNotReadSaysSo) {
    Sample morphed, compressed, old;
    morphed.root["meshes"][0]["weights"] = {0, 0.5};
    EXPECT_THAT(morphed.error().message, HasSubstr("shape applied"));
    morphed.root["meshes"][0]["weights"] = {0, 0};
    EXPECT_TRUE(morphed.read());
    compressed.root["extensionsRequired"] = {"EXT_something_else"};
    EXPECT_THAT(compressed.error().message, HasSubstr("EXT_something_else"));
    old.root["asset"]["version"] = "1.0";
    EXPECT_EQ(old.error().kind, ErrorKind::unsupported);
}

TEST(GltfReading, SizesAndPlacesThatAreNotTrueAreErrors) {
    constexpr std::uint64_t huge = 0xFFFFFFFFFFFFFFFFu;
    const auto refused = [](const char* what, const auto& change) {
        Sample sample;
        change(sample.root);
        const auto read = sample.read();
        EXPECT_FALSE(read) << what;
    };
    for (const std::uint64_t number : {std::uint64_t{5}, std::uint64_t{0x100000000}, huge}) {
        refused("count", [&](json& root) { root["accessors"][0]["count"] = number; });
        refused("buffer", [&](json& root) { root["bufferViews"][0]["buffer"] = number; });
        refused("view", [&](json& root) { root["accessors"][0]["bufferView"] = number; });
        refused("mesh", [&](json& root) { root["nodes"][0]["mesh"] = number; });
        refused("node", [&](json& root) { root["scenes"][0]["nodes"] = {number}; });
        refused("attribute",
                [&](json& root) { root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = number; });
        refused("indices", [&](json& root) { root["meshes"][0]["primitives"][0]["indices"] = number; });
        refused("material", [&](json& root) { root["meshes"][0]["primitives"][0]["material"] = number; });
        refused("type", [&](json& root) { root["accessors"][0]["componentType"] = number; });
        refused("offset", [&](json& root) { root["accessors"][0]["byteOffset"] = number; });
        refused("offset of a view", [&](json& root) { root["bufferViews"][0]["byteOffset"] = number; });
    }
    for (const std::uint64_t number : {std::uint64_t{53}, std::uint64_t{0x100000000}, huge}) {
        refused("length of a buffer", [&](json& root) { root["buffers"][0]["byteLength"] = number; });
        refused("length of a view", [&](json& root) { root["bufferViews"][0]["byteLength"] = number; });
    }
    for (const int stride : {0, 8, 256})
        refused("stride", [&](json& root) { root["bufferViews"][0]["byteStride"] = stride; });
    refused("negative", [&](json& root) { root["accessors"][0]["count"] = -1; });
    refused("fraction", [&](json& root) { root["accessors"][0]["count"] = 3.5; });
    refused("a matrix", [&](json& root) { root["accessors"][0]["type"] = "MAT2"; });
    refused("short matrix", [&](json& root) { root["nodes"][0]["matrix"] = {1, 0}; });
    refused("not a list", [&](json& root) { root["nodes"][0]["children"] = 1; });
    refused("circle", [&](json& root) { root["nodes"][0]["children"] = {0}; });
    refused("float indices", [&](json& root) { root["accessors"][1]["componentType"] = 5126; });
    refused("second buffer", [&](json& root) {
        root["buffers"].push_back({{"byteLength", 8}});
        root["bufferViews"][0]["buffer"] = 1;
    });
}

TEST(GltfReading, ATriangleCannotNameAVertexThatIsNotThere) {
    Sample sample;
    sample.binary[50] = 4;
    EXPECT_THAT(sample.error().message, HasSubstr("vertex 4 of a primitive that has 4"));
}

TEST(GltfReading, PositionsAreFinite) {
    Sample sample;
    sample.binary[3] = 0x7f;
    sample.binary[2] = 0xc0;
    EXPECT_THAT(sample.error().message, HasSubstr("position of vertex 0 is not finite"));
    Sample scaled;
    scaled.root["nodes"][0]["scale"] = {1e300, 1, 1};
    EXPECT_THAT(scaled.error().message, HasSubstr("not finite"));
}

TEST(GltfReading, MeshesAboveTheLimitsAreRefused) {
    EXPECT_TRUE(Sample().read({4, 1}));
    EXPECT_EQ(Sample().read({3, 1}).error().kind, ErrorKind::limit);
    EXPECT_EQ(Sample().read({4, 0}).error().kind, ErrorKind::limit);
}

TEST(GltfReading, CutOffAndDamagedFilesAreErrors) {
    const Sample sample;
    const auto whole = glb(sample.root, sample.binary);
    ASSERT_TRUE(read_gltf(whole, {}));
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(read_gltf(std::span(whole).first(size), {})) << size;
    for (const char* text :
         {"", "{", "[]", "{}", "null", R"({"asset": {}})", R"({"asset": {"version": 2}})",
          R"({"asset": {"version": "3.0"}})", R"({"asset": {"version": "2.1", "minVersion": "2.1"}})"})
        EXPECT_FALSE(read_gltf(bytes_of(text), {})) << text;
    // Brackets in brackets.
    std::string deep = R"({"asset": {"version": "2.0", "extras": )" + std::string(300000, '[');
    deep += std::string(300000, ']') + "}}";
    EXPECT_TRUE(read_gltf(bytes_of(deep), {}));
}

// ---- How programs write them ----------------------------------------------------------------------------------------

TEST(GltfReading, SparseAccessorsReplaceRowsOfTheirViewOrOfZeros) {
    Sample sample;
    const auto indices = sample.add_view(std::vector<std::uint8_t>{1, 0, 3, 0});
    const auto values = sample.add_view(floats({7, 8, 9, 1, 2, 3}));
    auto& accessor = sample.root["accessors"][0];
    accessor["sparse"] = {{"count", 2},
                          {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                          {"values", {{"bufferView", values}}}};
    EXPECT_EQ(sample.mesh().positions, (std::vector<Vector3f>{{0, 0, 0}, {7, 8, 9}, {0, 1, 0}, {1, 2, 3}}));
    accessor.erase("bufferView");
    EXPECT_EQ(sample.mesh().positions, (std::vector<Vector3f>{{0, 0, 0}, {7, 8, 9}, {0, 0, 0}, {1, 2, 3}}));
    accessor["count"] = 3;
    EXPECT_THAT(sample.error().message, HasSubstr("row that is not there"));
    accessor["count"] = 4000000000u;
    EXPECT_EQ(sample.error().kind, ErrorKind::limit) << "zeros are not believed";
    accessor["count"] = 4;
    for (const std::uint64_t count : {std::uint64_t{3}, std::uint64_t{0x100000000}, ~std::uint64_t{0}}) {
        accessor["sparse"]["count"] = count;
        EXPECT_THAT(sample.error().message, HasSubstr("goes beyond its view"));
    }
    accessor["sparse"]["count"] = 2;
    accessor["sparse"]["indices"]["componentType"] = 5126;
    EXPECT_EQ(sample.error().kind, ErrorKind::bad_input);
    accessor["sparse"].erase("indices");
    EXPECT_EQ(sample.error().kind, ErrorKind::bad_input);
}

TEST(GltfReading, AttributesMayHaveRowsThatNoVertexUses) {
    Sample sample;
    sample.add("TEXCOORD_0", floats({0, 0, 1, .25f, .5f, 1, 0, 2, 9, 9}), 5126, "VEC2")["count"] = 5;
    EXPECT_EQ(sample.mesh().texcoords.size(), 4u);
    sample.root["accessors"].back()["count"] = 3;
    EXPECT_THAT(sample.error().message, HasSubstr("3 of 4 vertices"));
}

TEST(GltfReading, AttributesOfAProgramsOwnAreNotLookedAt) {
    Sample sample;
    sample.add("_COLOR_0", floats({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), 5126, "VEC3");
    sample.add("color_0", floats({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), 5126, "VEC3");
    EXPECT_TRUE(sample.mesh().colours.empty());
    auto& attributes = sample.primitive()["attributes"];
    attributes["_POSITION"] = attributes["POSITION"];
    attributes.erase("POSITION");
    EXPECT_TRUE(sample.mesh().positions.empty());
}

TEST(GltfReading, TheLargestIndexBeginsStripsAnew) {
    Sample sample;
    sample.primitive()["indices"] = sample.add_accessor({0, 1, 2, 255, 1, 2, 3, 0}, 5121, "SCALAR", 8);
    sample.primitive()["mode"] = 5;
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 2, 3}, {2, 0, 3}}));
    sample.primitive()["mode"] = 6;
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{1, 2, 0}, {2, 3, 1}, {3, 0, 1}}));
}

TEST(GltfReading, VerticesThatAreNoNumbersAreLeftOutWhereTheyCanBe) {
    Sample sample;
    sample.binary[47] = 0x7f;  // of the vertex that nothing uses
    sample.binary[46] = 0xc0;
    EXPECT_EQ(sample.mesh().positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(sample.mesh().triangles, (std::vector<Triangle>{{0, 1, 2}}));
    ASSERT_EQ(sample.findings().remarks.size(), 1u);
    EXPECT_EQ(sample.findings().remarks[0].about, "not-finite");
    EXPECT_FALSE(sample.findings().remarks[0].is_loss);
    // A triangle uses it: one vertex of the four is too much to leave out.
    sample.primitive()["indices"] = sample.add_accessor({0, 1, 3}, 5121, "SCALAR", 3);
    EXPECT_THAT(sample.error().message, HasSubstr("position of vertex 3 is not finite"));
}

TEST(GltfReading, ContainersAreReadByTheirChunks) {
    const Sample sample;
    const auto whole = glb(sample.root, sample.binary);
    const auto expect_read = [&](const std::vector<std::uint8_t>& bytes, const char* what) {
        const auto mesh = read_gltf(bytes, {});
        ASSERT_TRUE(mesh) << what << ": " << mesh.error().message;
        EXPECT_EQ(mesh->positions, sample_positions) << what;
    };
    auto changed = whole;
    changed[8] = 12, changed[9] = 0;
    expect_read(changed, "a length that is too small");
    changed[9] = 0xff;
    expect_read(changed, "one that is too large");
    changed = whole;
    changed.insert(changed.end(), {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
    expect_read(changed, "bytes behind it");
    changed = whole;
    changed[whole.size() - sample.binary.size() - 8] += 8;
    expect_read(changed, "a chunk that says more than there is");
    changed = whole;
    changed.insert(changed.begin() + 12, {4, 0, 0, 0, 'X', 'T', 'R', 'A', 0, 0, 0, 0});
    expect_read(changed, "an unknown chunk before");
    changed = whole;
    for (auto at = changed.size() - sample.binary.size() - 9; changed[at] == ' '; --at) changed[at] = 0;
    expect_read(changed, "JSON filled up with zeros");
}

TEST(GltfReading, VersionsThatSayTheyMayBeReadAre) {
    Sample sample;
    sample.root["asset"] = {{"version", "2.1"}, {"minVersion", "2.0"}};
    EXPECT_EQ(sample.mesh().positions, sample_positions);
    sample.root["asset"] = {{"version", "2.1"}};
    EXPECT_EQ(sample.mesh().positions, sample_positions);
    const auto text = "\xEF\xBB\xBF" + json({{"asset", {{"version", "2.0"}}}}).dump();
    EXPECT_TRUE(read_gltf(bytes_of(text), {})) << "a byte order mark";
}

TEST(GltfReading, CompressedViewsAreReadWhereAPlainOneIsBeside) {
    Sample sample;
    sample.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0}, {"count", 4}};
    sample.root["extensionsUsed"] = {"EXT_meshopt_compression"};
    EXPECT_EQ(sample.mesh().positions, sample_positions);
    sample.root["extensionsRequired"] = {"EXT_meshopt_compression"};
    sample.root["buffers"][0]["extensions"]["EXT_meshopt_compression"]["fallback"] = true;
    EXPECT_THAT(sample.error().message, HasSubstr("EXT_meshopt_compression"));
    EXPECT_EQ(sample.error().kind, ErrorKind::unsupported);
}

// ---- Draco inside ---------------------------------------------------------------------------------------------------

// Four vertices with colours of 16 bits, one triangle, as KHR_draco_mesh_compression has them.
struct DracoSample : Sample {
    explicit DracoSample(bool is_damaged = false) {
        draco::TriangleSoupMeshBuilder builder;
        builder.Start(1);
        using draco::GeometryAttribute;
        const int position = builder.AddAttribute(GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
        const int colour = builder.AddAttribute(GeometryAttribute::COLOR, 3, draco::DT_UINT16);
        const std::array<Vector3f, 3> p{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
        const std::array<std::array<std::uint16_t, 3>, 3> c{{{0, 0, 65535}, {0, 65535, 0}, {65535, 0, 0}}};
        builder.SetAttributeValuesForFace(position, draco::FaceIndex(0), &p[0], &p[1], &p[2]);
        builder.SetAttributeValuesForFace(colour, draco::FaceIndex(0), &c[0], &c[1], &c[2]);
        auto mesh = builder.Finalize();
        mesh->attribute(position)->set_unique_id(7);
        mesh->attribute(colour)->set_unique_id(3);
        draco::Encoder encoder;
        draco::EncoderBuffer buffer;
        EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
        std::vector<std::uint8_t> bytes(buffer.data(), buffer.data() + buffer.size());
        if (is_damaged) bytes.resize(bytes.size() / 2);
        root["accessors"] = json::parse(R"([{"componentType": 5126, "count": 3, "type": "VEC3"},
            {"componentType": 5125, "count": 3, "type": "SCALAR"},
            {"componentType": 5123, "normalized": true, "count": 3, "type": "VEC3"}])");
        primitive()["attributes"]["COLOR_0"] = 2;
        primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", add_view(bytes)},
                                                                   {"attributes", {{"POSITION", 7}, {"COLOR_0", 3}}}};
        root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    }
};

TEST(GltfReading, DracoInsideIsRead) {
    DracoSample sample;
    sample.root["nodes"][0]["translation"] = {0, 0, 5};
    sample.root["nodes"].push_back({{"mesh", 0}});
    sample.root["scenes"][0]["nodes"] = {0, 1};
    const auto mesh = sample.mesh();
    ASSERT_EQ(mesh.positions.size(), 6u);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    const auto& [a, b, c] = mesh.triangles[0];
    std::vector<std::pair<Vector3f, Colour>> corners;
    for (const auto v : {a, b, c}) corners.emplace_back(mesh.positions[v], mesh.colours[v]);
    std::sort(corners.begin(), corners.end());
    EXPECT_EQ(corners, (std::vector<std::pair<Vector3f, Colour>>{
                           {{0, 0, 5}, {0, 0, 255}}, {{0, 1, 5}, {255, 0, 0}}, {{1, 0, 5}, {0, 255, 0}}}));
    sample.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 9;
    EXPECT_THAT(sample.error().message, HasSubstr("no attribute 9"));
}

TEST(GltfReading, DamagedDracoInsideIsAnError) {
    EXPECT_EQ(DracoSample(true).error().kind, ErrorKind::bad_input);
    DracoSample none;
    none.primitive()["extensions"]["KHR_draco_mesh_compression"].erase("bufferView");
    EXPECT_EQ(none.error().kind, ErrorKind::bad_input);
}

// ---- Buffers outside of the file ------------------------------------------------------------------------------------

class GltfBuffers : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_gltf_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        outside = name;
        folder = outside / "folder";
        std::filesystem::create_directories(folder / "more data");
        for (const auto& path : {outside / "a.bin", folder / "a.bin", folder / "more data" / "a.bin",
                                 folder / "100%.bin", folder / "a%20b.bin"})
            std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(sample.binary.data()), 52);
        std::filesystem::create_symlink(outside / "a.bin", folder / "link.bin");
        std::filesystem::create_symlink(folder / "a.bin", folder / "inner.bin");
    }
    void TearDown() override { std::filesystem::remove_all(outside); }
    Result<Mesh> with(const std::string& uri) {
        sample.root["buffers"][0]["uri"] = uri;
        return read_gltf(bytes_of(sample.root.dump()), folder);
    }
    Sample sample;
    std::filesystem::path outside, folder;
};

TEST_F(GltfBuffers, InTheFolderAreRead) {
    for (const char* uri : {"a.bin", "./a.bin", "more%20data/a.bin", "inner.bin", "more data/../a.bin",
                            "more data\\a.bin", ".\\a.bin", "100%.bin", "a%20b.bin", "a.bin?v=1"}) {
        const auto mesh = with(uri);
        ASSERT_TRUE(mesh) << uri << ": " << mesh.error().message;
        EXPECT_EQ(mesh->positions, sample_positions);
    }
}

TEST_F(GltfBuffers, ElsewhereAreNot) {
    const auto absolute = (folder / "a.bin").string();
    for (const std::string& uri :
         {std::string("../a.bin"), std::string("%2e%2e/a.bin"), absolute, "file://" + absolute,
          std::string("http://example.org/a.bin"), std::string("link.bin"), std::string("none.bin"),
          std::string("more data"), std::string("..\\a.bin"), std::string(""), std::string("a.bin%00"),
          std::string("a%2"), std::string("data:,0")})
        EXPECT_FALSE(with(uri)) << uri;
    sample.root["buffers"][0]["uri"] = "a.bin";
    EXPECT_THAT(read_gltf(bytes_of(sample.root.dump()), {}).error().message, HasSubstr("not read here"));
}

TEST_F(GltfBuffers, InTheTextAreDecoded) {
    sample.root["buffers"][0]["byteLength"] = 3;
    sample.root["bufferViews"] = json::parse(R"([{"buffer": 0, "byteLength": 3}])");
    sample.root["accessors"] = json::parse(R"([{"bufferView": 0, "componentType": 5121, "count": 1, "type": "VEC3"}])");
    sample.primitive().erase("indices");
    for (const char* uri : {"data:application/octet-stream;base64,AQL/", "data:;base64,AQL/"})
        EXPECT_EQ(with(uri)->positions, (std::vector<Vector3f>{{1, 2, 255}})) << uri;
    for (const char* uri : {"DATA:text/plain;charset=utf-8;BASE64,AQL%2F", "data:;base64,AQ L\n_", "data:,%01%02%FF"})
        EXPECT_EQ(with(uri)->positions, (std::vector<Vector3f>{{1, 2, 255}})) << uri;
    for (const char* uri : {"data:application/octet-stream;base64,AQI=", "data:;base64,A*L/", "data:;base64,"})
        EXPECT_FALSE(with(uri)) << uri;
}

TEST_F(GltfBuffers, AFileThatIsShorterThanItSaysIsAnError) {
    sample.root["buffers"][0]["byteLength"] = 53;
    EXPECT_THAT(with("a.bin").error().message, HasSubstr("52 bytes of 53"));
}

// ---- A whole stream in one file -------------------------------------------------------------------------------------

class GltfStream : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_gltf_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
        path = folder / "stream.glb";
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    json root() const {
        const auto bytes = read_file(path).value();
        internal::ByteReader reader{std::span(bytes).subspan(12)};
        const auto size = reader.u32();
        reader.u32();
        const auto text = reader.bytes(size);
        return json::parse(text.begin(), text.end());
    }
    // What an accessor of floats holds.
    std::vector<float> numbers(const json& root_of, std::size_t accessor) const {
        const auto bytes = read_file(path).value();
        const auto& view = root_of["bufferViews"][root_of["accessors"][accessor]["bufferView"].get<std::size_t>()];
        const auto begin = bytes.size() - root_of["buffers"][0]["byteLength"].get<std::size_t>();
        internal::ByteReader reader{std::span(bytes).subspan(begin + view["byteOffset"].get<std::size_t>(),
                                                             view["byteLength"].get<std::size_t>())};
        std::vector<float> out;
        while (reader.remaining() > 0) out.push_back(std::bit_cast<float>(reader.u32()));
        return out;
    }
    // The keys of the node's scale: times and values.
    std::pair<std::vector<float>, std::vector<float>> keys_of(const json& root_of, std::size_t node) const {
        for (const auto& channel : root_of["animations"][0]["channels"]) {
            if (channel["target"]["node"] != node) continue;
            EXPECT_EQ(channel["target"]["path"], "scale");
            const auto& sampler = root_of["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()];
            EXPECT_EQ(sampler["interpolation"], "STEP");
            return {numbers(root_of, sampler["input"]), numbers(root_of, sampler["output"])};
        }
        ADD_FAILURE() << "node " << node << " is not animated";
        return {};
    }
    std::filesystem::path folder, path;
};

TEST_F(GltfStream, EachFrameIsShownWhileItLastsAndTheLastToTheEnd) {
    auto animation = GltfAnimation::create(path);
    ASSERT_TRUE(animation);
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(animation->add(random_mesh(9u + k, 10, 12), k * 0.5, "frame"));
    EXPECT_FALSE(std::filesystem::exists(path));
    ASSERT_TRUE(animation->finish(2));
    const json file = root();
    EXPECT_EQ(file["meshes"].size(), 3u);
    using Numbers = std::vector<float>;
    EXPECT_EQ(keys_of(file, 0), std::pair(Numbers({0, .5f}), Numbers({1, 1, 1, 0, 0, 0})));
    EXPECT_EQ(keys_of(file, 1), std::pair(Numbers({0, .5f, 1}), Numbers({0, 0, 0, 1, 1, 1, 0, 0, 0})));
    EXPECT_EQ(keys_of(file, 2), std::pair(Numbers({0, 1, 2}), Numbers({0, 0, 0, 1, 1, 1, 1, 1, 1})));
}

TEST_F(GltfStream, WithoutAnimationTheFirstFrameIsShownInMetres) {
    Mesh first = random_mesh(1, 10, 12);
    auto animation = GltfAnimation::create(path);
    ASSERT_TRUE(animation->add(first, 0, "first"));
    ASSERT_TRUE(animation->add(random_mesh(2, 20, 22), 1, "second"));
    ASSERT_TRUE(animation->finish(2));
    const auto mesh = read_mesh(path);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_TRUE(scale_positions(first, 0.001));
    EXPECT_EQ(mesh->positions, first.positions);
    EXPECT_EQ(mesh->triangles, first.triangles);
    EXPECT_EQ(mesh->colours, first.colours);
}

TEST_F(GltfStream, EqualTrianglesAreThereOnce) {
    Mesh mesh = random_mesh(1, 10, 12);
    auto animation = GltfAnimation::create(path);
    double time = 0;
    const auto next = [&] { ASSERT_TRUE(animation->add(mesh, time++, "frame")); };
    next();
    mesh.positions[3][1] += 5;
    mesh.colours[2] = {1, 2, 3};
    next();
    std::swap(mesh.triangles[0], mesh.triangles[1]);
    next();
    ASSERT_TRUE(animation->finish(3));
    const json file = root();
    const auto of = [&](std::size_t m, const char* attribute) {
        const auto& primitive = file["meshes"][m]["primitives"][0];
        return std::string(attribute) == "indices" ? primitive["indices"] : primitive["attributes"][attribute];
    };
    EXPECT_EQ(of(0, "indices"), of(1, "indices"));
    EXPECT_EQ(of(0, "TEXCOORD_0"), of(1, "TEXCOORD_0"));
    EXPECT_NE(of(0, "POSITION"), of(1, "POSITION"));
    EXPECT_NE(of(1, "indices"), of(2, "indices"));
}

TEST_F(GltfStream, TrianglesOfOneFrameTakeTwoBytesAnIndexWhereTheVerticesAreFewEnough) {
    // An odd number of indices, so that what is behind them has to be brought to a multiple of four bytes.
    Mesh few = random_mesh(1, 0xFFFF, 13), many = random_mesh(2, 0x10000, 13);
    few.triangles[12] = {0, 1, 0xFFFE};
    for (const auto& [mesh, type] : {std::pair(few, 5123), std::pair(many, 5125)}) {
        auto animation = GltfAnimation::create(path);
        ASSERT_TRUE(animation->add(mesh, 0, "first", nullptr, GltfTriangles::of_one_frame));
        ASSERT_TRUE(animation->finish(1));
        const json file = root();
        EXPECT_EQ(file["accessors"][file["meshes"][0]["primitives"][0]["indices"].get<std::size_t>()]["componentType"],
                  type);
        const auto read = read_mesh(path);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->triangles, mesh.triangles);
        EXPECT_EQ(read->colours, mesh.colours);
    }
}

TEST_F(GltfStream, WhatIsUpBecomesY) {
    Mesh mesh;
    mesh.positions = {{0, 0, 2000}, {1000, 0, 0}};
    auto animation = GltfAnimation::create(path, {.up = UpAxis::plus_z, .title = "A dance", .rights = "by nobody"});
    ASSERT_TRUE(animation->add(mesh, 0, "frame 0"));
    ASSERT_TRUE(animation->finish(1));
    const auto read = read_mesh(path);
    ASSERT_TRUE(read);
    const std::vector<Vector3f> expected{{0, 2, 0}, {1, 0, 0}};
    for (std::size_t v = 0; v < 2; ++v)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(read->positions[v][i], expected[v][i], 1e-6);
    EXPECT_EQ(root()["nodes"].back()["name"], "A dance");
    EXPECT_EQ(root()["asset"]["copyright"], "by nobody");
}

TEST_F(GltfStream, FramesWithoutVerticesShowNothingAndTimesThatStandStillGoOn) {
    auto animation = GltfAnimation::create(path);
    ASSERT_TRUE(animation->add(random_mesh(1, 10, 12), 5, "first"));  // the first begins at 0
    ASSERT_TRUE(animation->add(Mesh(), 6, "empty"));
    ASSERT_TRUE(animation->add(random_mesh(2, 10, 12), 6, "second"));
    ASSERT_TRUE(animation->finish(0));
    const json file = root();
    EXPECT_EQ(file["meshes"].size(), 2u);
    EXPECT_EQ(keys_of(file, 0).first, (std::vector<float>{0, 6}));
    const auto times = keys_of(file, 1).first;
    ASSERT_EQ(times.size(), 3u);
    EXPECT_LT(6, times[1]);
    EXPECT_LT(times[1], times[2]);
}

TEST_F(GltfStream, NothingIsLeftOfAFileThatIsNotFinished) {
    {
        auto animation = GltfAnimation::create(path);
        ASSERT_TRUE(animation->add(random_mesh(1, 10, 12), 0, "first"));
        Mesh bad = random_mesh(1, 10, 12);
        bad.triangles[0][0] = 10;
        EXPECT_FALSE(animation->add(bad, 1, "bad"));
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder));
    EXPECT_THAT(GltfAnimation::create("/dev/null").error().message, HasSubstr("not to a pipe"));
}

}  // namespace
}  // namespace htvm
