// What a glTF's materials look like: images, parts, colours.
#include "gmock/gmock.h"
#include "io/gltf_samples.h"

namespace htvm {
namespace {

using nlohmann::json;
using samples::bytes_of;
using samples::floats;
using samples::text_of;
using testing::HasSubstr;

const Colour white{255, 255, 255};

// A triangle with texture coordinates, whose set 1 differs.
struct Textured : samples::GltfSample {
    Textured() {
        add("TEXCOORD_0", floats({0, 0, 0, 0, 0, 0, 0, 0}), 5126, "VEC2");
        add("TEXCOORD_1", floats({0, 0, 1, .25f, .5f, 1, 0, 0}), 5126, "VEC2");
    }
    std::string image() const {
        const auto texture = findings().texture;
        return texture.images.size() == 1 ? text_of(texture.images[0].bytes) : "";
    }
    // The remark about that, or nothing.
    std::string remark_about(const std::string& about) const {
        for (const auto& remark : findings().remarks)
            if (remark.about == about) return remark.text;
        return "";
    }
    void add_primitive(const json& material) {
        auto other = primitive();
        root["materials"].push_back(material);
        other["material"] = root["materials"].size() - 1;
        root["meshes"][0]["primitives"].push_back(other);
    }
};

TEST(GltfLook, TheBaseColoursTextureIsMultipliedByItsFactor) {
    Textured sample;
    sample.add_texture();
    sample.material(
        R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1]}})");
    const auto texture = sample.findings().texture;
    ASSERT_EQ(texture.images.size(), 1u);
    ASSERT_EQ(texture.parts.size(), 1u);
    EXPECT_EQ(texture.parts[0].image, 0u);
    EXPECT_EQ(texture.parts[0].colour, (Colour{188, 255, 255}));
    EXPECT_TRUE(texture.colours_multiply);
    EXPECT_TRUE(texture.part_of_triangle.empty());
    EXPECT_TRUE(sample.mesh().colours.empty());
}

TEST(GltfLook, SpecularAndGlossinessHaveADiffuseTexture) {
    Textured sample;
    sample.add_texture();
    auto& material = sample.material(R"({"extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseTexture": {"index": 0, "texCoord": 1}, "diffuseFactor": [1, 0.5, 1, 1]}}})");
    sample.root["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
    EXPECT_EQ(sample.image(), "image");
    EXPECT_EQ(sample.findings().texture.parts[0].colour, (Colour{255, 188, 255}));
    EXPECT_EQ(sample.mesh().texcoords[1], (Vector2f{1, .75f}));
    // What stands in for it where a reader does not know the extension does not count.
    sample.add_texture("other");
    material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1;
    EXPECT_EQ(sample.image(), "image");
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"].erase("diffuseTexture");
    EXPECT_EQ(sample.image(), "other");
}

TEST(GltfLook, WhatEmitsOverBlackIsWhatIsSeen) {
    Textured sample;
    sample.add_texture();
    sample.add("COLOR_0", floats({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), 5126, "VEC3");
    auto& material = sample.material(R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
        "emissiveFactor": [0.25, 0.25, 0.5], "emissiveTexture": {"index": 0, "texCoord": 1},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}}})");
    EXPECT_EQ(sample.image(), "image");
    EXPECT_EQ(sample.findings().texture.parts[0].colour, (Colour{188, 188, 255}));
    EXPECT_EQ(sample.mesh().texcoords[1], (Vector2f{1, .75f}));
    EXPECT_TRUE(sample.mesh().colours.empty()) << "black vertices do not darken what emits";
    // Unlit, the base colour is all that is seen.
    material["extensions"]["KHR_materials_unlit"] = json::object();
    EXPECT_EQ(sample.image(), "");
    EXPECT_EQ(sample.mesh().colours[0], (Colour{0, 0, 0}));
}

TEST(GltfLook, AnEmissiveTextureStandsInForABaseColourThatIsNotThere) {
    Textured sample;
    sample.add_texture();
    auto& material = sample.material(R"({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}})");
    EXPECT_EQ(sample.image(), "image");
    material["emissiveFactor"] = {0, 0, 0};
    EXPECT_EQ(sample.image(), "");
}

TEST(GltfLook, GlowBesidesABaseColourIsLeftOutAndTold) {
    Textured sample;
    sample.add_texture();
    auto& material = sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}})");
    EXPECT_EQ(sample.remark_about("emission"), "") << "the same image says nothing else";
    sample.add_texture("glow");
    material["emissiveTexture"]["index"] = 1;
    EXPECT_EQ(sample.image(), "image");
    EXPECT_THAT(sample.remark_about("emission"), HasSubstr("glows"));
}

TEST(GltfLook, PartsAreInTheOrderOfMaterialsAndEachTriangleSaysItsOwn) {
    Textured sample;
    sample.add_texture("first");
    sample.add_texture("second");
    sample.root["materials"].push_back({{"name", "unused"}});
    sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}})");
    auto other = sample.primitive();
    other["material"] = 0;
    sample.root["materials"][0] = json::parse(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
    sample.root["meshes"][0]["primitives"].push_back(other);
    sample.add_primitive(json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}})"));
    const auto texture = sample.findings().texture;
    ASSERT_EQ(texture.parts.size(), 3u);
    EXPECT_EQ(text_of(texture.images[0].bytes), "first");
    EXPECT_EQ(text_of(texture.images[1].bytes), "second");
    EXPECT_EQ(texture.parts[0].image, 0u);
    EXPECT_EQ(texture.parts[1].image, 1u);
    EXPECT_EQ(texture.parts[2].image, std::nullopt);
    EXPECT_EQ(texture.parts[2].colour, (Colour{255, 0, 0}));
    EXPECT_EQ(texture.part_of_triangle, (std::vector<std::uint16_t>{1, 0, 2}));
    EXPECT_EQ(sample.mesh().positions.size(), 4u) << "parts share vertices";
}

TEST(GltfLook, MaterialsThatLookAlikeAreOnePart) {
    Textured sample;
    sample.add_texture();
    sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
    sample.add_primitive(
        json::parse(R"({"name": "again", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})"));
    EXPECT_EQ(sample.findings().texture.parts.size(), 1u);
    EXPECT_TRUE(sample.findings().texture.part_of_triangle.empty());
}

TEST(GltfLook, WithoutImagesMaterialsColourTheVertices) {
    Textured sample;
    sample.material(R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}})");
    EXPECT_EQ(sample.mesh().colours, std::vector<Colour>(4, {255, 0, 0}));
    sample.add_primitive(json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 1]}})"));
    const auto mesh = sample.mesh();
    ASSERT_EQ(mesh.colours.size(), 8u);
    EXPECT_EQ(mesh.colours[7], (Colour{0, 0, 255}));
    // A grey for all of it, which programs write by default, says nothing.
    for (auto& material : sample.root["materials"])
        material["pbrMetallicRoughness"]["baseColorFactor"] = {.8, .8, .8, 1};
    EXPECT_TRUE(sample.mesh().colours.empty());
}

TEST(GltfLook, ColoursOfVerticesMultiplyAnImageUnlessTheyAreWhite) {
    Textured sample;
    sample.add_texture();
    sample.material(
        R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1]}})");
    sample.add("COLOR_0", floats({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}), 5126, "VEC3");
    EXPECT_TRUE(sample.mesh().colours.empty());
    sample.add("COLOR_0", floats({2, .5f, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1}), 5126, "VEC3");
    EXPECT_EQ(sample.mesh().colours[0], (Colour{255, 188, 0})) << "the factor is the part's, light above 1 is white";
    EXPECT_EQ(sample.mesh().colours[1], white);
}

TEST(GltfLook, TransformsOfTexturesApplyToWhicheverTextureIsTaken) {
    Textured sample;
    sample.add_texture();
    const char* transformed = R"({"index": 0, "extensions": {"KHR_texture_transform":
        {"offset": [0.5, 0.25], "scale": [2, 1], "texCoord": 1}}})";
    auto& material = sample.material(R"({"pbrMetallicRoughness": {}})");
    const auto expect_placed = [&] { EXPECT_EQ(sample.mesh().texcoords[1], (Vector2f{2.5f, .5f})); };
    material["pbrMetallicRoughness"]["baseColorTexture"] = json::parse(transformed);
    expect_placed();
    material = {{"emissiveTexture", json::parse(transformed)}, {"emissiveFactor", {1, 1, 1}}};
    expect_placed();
    material = json::object();
    material["extensions"]["KHR_materials_pbrSpecularGlossiness"]["diffuseTexture"] = json::parse(transformed);
    expect_placed();
}

TEST(GltfLook, AnImageThatIsReadIsTakenBeforeOneThatIsNot) {
    Textured sample;
    sample.add_texture("plain");
    sample.add_texture("\xABKTX 20\xBB");
    sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
    auto& texture = sample.root["textures"][0];
    for (const char* name : {"KHR_texture_basisu", "EXT_texture_avif"}) {
        texture["extensions"] = {{name, {{"source", 1}}}};
        EXPECT_EQ(sample.image(), "plain");
        EXPECT_THAT(sample.remark_about("texture-beside"), HasSubstr("not read"));
    }
    texture["extensions"] = {{"MSFT_texture_dds", {{"source", 1}}}};
    EXPECT_EQ(sample.image(), "plain");
    texture["extensions"] = {{"EXT_texture_webp", {{"source", 1}}}};
    EXPECT_EQ(sample.image(), "\xABKTX 20\xBB") << "a WebP is read";
    texture.erase("source");
    texture["extensions"] = {{"KHR_texture_basisu", {{"source", 1}}}};
    sample.root["extensionsRequired"] = {"KHR_texture_basisu"};
    EXPECT_THAT(sample.findings().texture.images[0].name, HasSubstr("KTX2 with Basis"));
}

TEST(GltfLook, SeeThroughImagesAreTold) {
    Textured sample;
    sample.add_texture("\x89PNG");
    auto& material =
        sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK"})");
    EXPECT_THAT(sample.remark_about("alpha"), HasSubstr("see-through"));
    material["alphaMode"] = "OPAQUE";
    EXPECT_EQ(sample.remark_about("alpha"), "");
    Textured photo;
    photo.add_texture("\xFF\xD8\xFF");
    photo.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"})");
    EXPECT_EQ(photo.remark_about("alpha"), "") << "a JPEG has no alpha";
    // An alpha of nothing shows nothing.
    material["alphaMode"] = "BLEND";
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0};
    EXPECT_TRUE(sample.mesh().positions.empty());
}

TEST(GltfLook, AnImageWithoutCoordinatesIsLeftOutAndTold) {
    Textured sample;
    sample.add_texture();
    sample.material(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 5}}})");
    EXPECT_TRUE(sample.findings().texture.images.empty());
    EXPECT_THAT(sample.remark_about("no-coordinates"), HasSubstr("left out"));
}

}  // namespace
}  // namespace htvm
