// Which meshes of a glTF are shown, and where.
#include <cmath>

#include "gmock/gmock.h"
#include "io/gltf_samples.h"

namespace htvm {
namespace {

using nlohmann::json;
using samples::floats;
using samples::sample_positions;
using testing::HasSubstr;
using Sample = samples::GltfSample;

bool tells_of(const MeshFindings& findings, const std::string& about, bool is_loss = false) {
    for (const auto& remark : findings.remarks)
        if (remark.about == about) return remark.is_loss == is_loss;
    return false;
}

TEST(GltfScene, NodesThatAreNotVisibleAreNotReadNorWhatIsBelow) {
    Sample sample;
    sample.root["extensionsRequired"] = {"KHR_node_visibility"};
    sample.root["nodes"] = json::parse(R"([{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0}])");
    EXPECT_EQ(sample.mesh().positions.size(), 8u);
    sample.root["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = false;
    EXPECT_EQ(sample.mesh().positions.size(), 4u);
    sample.root["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = true;
    EXPECT_EQ(sample.mesh().positions.size(), 8u);
    sample.root["nodes"][0]["extensions"]["KHR_node_visibility"]["visible"] = false;
    EXPECT_TRUE(sample.mesh().positions.empty());
}

TEST(GltfScene, InstancesAreMeshesOfTheirOwn) {
    Sample sample;
    const auto moves = sample.add_accessor(floats({1, 0, 0, 0, 0, 5}), 5126, "VEC3", 2);
    // As signed bytes: not turned, and half a turn about z.
    const auto turns = sample.add_accessor({0, 0, 0, 127, 0, 0, 127, 0}, 5120, "VEC4", 2);
    sample.root["accessors"][turns]["normalized"] = true;
    const auto scales = sample.add_accessor(floats({2, 2, 2, 1, 1, 1}), 5126, "VEC3", 2);
    sample.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", moves}, {"ROTATION", turns}, {"SCALE", scales}};
    sample.root["nodes"][0]["translation"] = {0, 10, 0};
    sample.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    const auto mesh = sample.mesh();
    ASSERT_EQ(mesh.positions.size(), 8u);
    EXPECT_EQ(mesh.positions[1], (Vector3f{3, 10, 0}));
    EXPECT_EQ(mesh.positions[5], (Vector3f{-1, 10, 5}));
    EXPECT_EQ(mesh.triangles[1], (Triangle{4, 5, 6}));
    // As many as it says, without any data: not believed.
    sample.root["accessors"][moves] = {{"componentType", 5126}, {"count", 4000000000u}, {"type", "VEC3"}};
    sample.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", moves}};
    EXPECT_EQ(sample.error().kind, ErrorKind::limit);
}

TEST(GltfScene, TheOriginIsTakenOffAfterTheNodesHaveMoved) {
    Sample sample;
    sample.root["nodes"][0]["translation"] = {500000.125, 0, 5400000.25};
    MeshReadOptions options;
    options.origin = {500000, 0, 5400000};
    const auto mesh = read_gltf(samples::glb(sample.root, sample.binary), {}, options);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->positions[1], (Vector3f{1.125f, 0, .25f}));
}

TEST(GltfScene, ASkeletonThatLeavesTheShapeAsItIsMayBeThere) {
    Sample sample;
    // The joints stand at 0, 1, 0 and 0, 3, 0, and are bound there; all under a node that makes it larger.
    sample.root["nodes"] = json::parse(R"([{"children": [1, 2], "scale": [2, 2, 2]},
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [0, 1, 0], "children": [3]}, {"translation": [0, 2, 0]}])");
    const auto bind = sample.add_accessor(
        floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -3, 0, 1}),
        5126, "MAT4", 2);
    sample.root["skins"] = {{{"joints", {2, 3}}, {"inverseBindMatrices", bind}}};
    const auto mesh = sample.mesh();
    EXPECT_EQ(mesh.positions[1], (Vector3f{2, 0, 0})) << "by the joints, not by the mesh's own node";
    EXPECT_EQ(mesh.positions[3], (Vector3f{10, 12, 14}));
    sample.root["nodes"][3]["rotation"] = {0, 0, std::sqrt(.5), std::sqrt(.5)};
    EXPECT_THAT(sample.error().message, HasSubstr("pose applied"));
    sample.root["skins"][0]["joints"] = {2, 17};
    EXPECT_EQ(sample.error().kind, ErrorKind::bad_input);
}

TEST(GltfScene, WhatIsNotTakenIsTold) {
    Sample sample;
    EXPECT_TRUE(sample.findings().remarks.empty());
    sample.root["scenes"].push_back(json::object());
    sample.root["animations"] = json::array({json::object()});
    sample.root["extensionsUsed"] = {"EXT_something_else", "KHR_xmp_json_ld", "KHR_materials_variants"};
    auto& primitives = sample.root["meshes"][0]["primitives"];
    primitives.push_back(primitives[0]);
    primitives.push_back(primitives[0]);
    primitives[1]["mode"] = 0;
    primitives[2]["mode"] = 1;
    const auto findings = sample.findings();
    for (const char* about : {"scenes", "animation", "extension"}) EXPECT_TRUE(tells_of(findings, about)) << about;
    for (const char* about : {"points", "lines"}) EXPECT_TRUE(tells_of(findings, about, true)) << about;
    EXPECT_EQ(findings.remarks.size(), 5u);
    EXPECT_EQ(sample.mesh().positions.size(), 4u);
}

TEST(GltfScene, MeshesWithoutNodesAreAllRead) {
    Sample sample;
    sample.root.erase("nodes");
    sample.root.erase("scenes");
    EXPECT_EQ(sample.mesh().positions, sample_positions);
}

}  // namespace
}  // namespace htvm
