#include "io/texture_file.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/image_samples.h"
#include "io/mesh_samples.h"
#include "io/obj.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;
using samples::plain;
using samples::write_bytes;
using samples::write_text;
using testing::HasSubstr;

const Colour red{250, 10, 10}, green{10, 250, 10}, blue{10, 10, 250};

const char* const obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n";

class TextureFile : public testing::Test {
protected:
    void SetUp() override {
        std::string made = (fs::temp_directory_path() / "htvm_texture_XXXXXX").string();
        ASSERT_NE(mkdtemp(made.data()), nullptr);
        folder = made;
    }
    void TearDown() override { fs::remove_all(folder); }

    void image(const std::string& file, const Colour& colour) {
        write_bytes(folder / file, *write_png_image(plain(4, 4, colour)));
    }
    void mesh(const std::string& file, const std::string& text) { write_text(folder / file, text); }

    Result<TexturedMesh> read(const std::string& pattern, std::size_t place = 0, TextureOptions options = {},
                              TextureUse use = TextureUse::where_colourless) {
        const auto files = find_sequence((folder / pattern).string());
        if (!files) return tl::unexpected(files.error());
        if (!options.files.empty() && options.files != "none") options.files = (folder / options.files).string();
        auto textures = TextureFiles::open(options, *files);
        if (!textures) return tl::unexpected(textures.error());
        auto out = textures->read(place, use);
        name = textures->image_name();
        return out;
    }
    // The colour of the image that the mesh gets; black: none.
    Colour colour_of(const Result<TexturedMesh>& read) {
        EXPECT_TRUE(read.has_value()) << (read ? "" : read.error().message);
        if (!read || !read->texture) return {};
        return {read->texture->rgb[0], read->texture->rgb[1], read->texture->rgb[2]};
    }
    static std::string error_of(const Result<TexturedMesh>& read) { return read ? "no error" : read.error().message; }

    fs::path folder;
    std::string name;
};

TEST_F(TextureFile, ItsNameBesideTheMesh) {
    mesh("a.obj", obj);
    image("a.png", red);
    EXPECT_EQ(colour_of(read("a.obj")), red);
    EXPECT_EQ(name, (folder / "a.png").string());
    fs::rename(folder / "a.png", folder / "a.JPG");
    EXPECT_EQ(colour_of(read("a.obj")), red) << "whatever its letters, and whatever is in it";
    fs::remove(folder / "a.JPG");
    EXPECT_EQ(colour_of(read("a.obj")), Colour{}) << "without one there is no texture";
}

TEST_F(TextureFile, OfAnObjByItsMaterial) {
    image("skin of a.png", green);
    image("a.png", red);
    mesh("a.mtl", "newmtl other\nmap_Kd a.png\nnewmtl skin\nKd 1 1 1\nmap_Kd -s 1 1 1 -blendu on skin of a.png\n");
    mesh("a.obj", std::string("mtllib a.mtl\nusemtl other\nusemtl skin\n") + obj);
    EXPECT_EQ(colour_of(read("a.obj")), green) << "of the material that faces use";
    mesh("a.mtl", "newmtl skin\r\nmap_Kd C:\\work\\textures\\skin of a.png\r\n");
    EXPECT_EQ(colour_of(read("a.obj")), green) << "folders of another machine are passed over";
    fs::remove(folder / "a.mtl");
    EXPECT_EQ(colour_of(read("a.obj")), red) << "without the material file, by its name";
}

TEST_F(TextureFile, OfAPlyByItsComment) {
    Mesh square;
    square.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    square.texcoords = {{0, 0}, {1, 0}, {0, 0.75f}};
    square.triangles = {{0, 1, 2}};
    MeshFileOptions options;
    options.texture = "my skin.png";
    ASSERT_TRUE(write_mesh(folder / "a.ply", square, options).has_value());
    image("my skin.png", blue);
    const auto made = read("a.ply");
    EXPECT_EQ(colour_of(made), blue);
    samples::expect_equal(made->mesh, square);
}

TEST_F(TextureFile, OfAGltfInAFileOfItsOwnOrInside) {
    Mesh triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.texcoords = {{0, 0}, {1, 0}, {0, 0.75f}};
    triangle.triangles = {{0, 1, 2}};
    ASSERT_TRUE(write_mesh(folder / "plain.glb", triangle).has_value());
    // The same with a material, as JSON and a buffer beside it.
    const auto glb = *read_file(folder / "plain.glb");
    const auto json_bytes = static_cast<std::size_t>(glb[12] | glb[13] << 8 | glb[14] << 16);
    auto root = nlohmann::json::parse(glb.begin() + 20, glb.begin() + 20 + static_cast<std::ptrdiff_t>(json_bytes));
    write_bytes(folder / "a.bin", {glb.begin() + 28 + static_cast<std::ptrdiff_t>(json_bytes), glb.end()});
    root["buffers"][0]["uri"] = "a.bin";
    root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    root["meshes"][0]["primitives"][0]["material"] = 0;
    root["textures"] = {{{"source", 0}}};
    root["images"] = {{{"uri", "my%20skin.png"}}};
    write_text(folder / "a.gltf", root.dump());
    image("my skin.png", green);
    const auto beside = read("a.gltf");
    EXPECT_EQ(colour_of(beside), green);
    EXPECT_EQ(beside->mesh.texcoords, triangle.texcoords) << "counted from the bottom, whatever the format does";

    const auto png = *write_png_image(plain(2, 2, blue));
    write_bytes(folder / "image.bin", png);
    root["buffers"].push_back({{"uri", "image.bin"}, {"byteLength", png.size()}});
    root["bufferViews"].push_back({{"buffer", root["buffers"].size() - 1}, {"byteLength", png.size()}});
    root["images"] = {{{"bufferView", root["bufferViews"].size() - 1}, {"mimeType", "image/png"}}};
    write_text(folder / "a.gltf", root.dump());
    EXPECT_EQ(colour_of(read("a.gltf")), blue);

    root["images"] = {{{"uri", "data:image/png;base64,####"}}};
    write_text(folder / "a.gltf", root.dump());
    EXPECT_THAT(error_of(read("a.gltf")), HasSubstr("an image inside of it is not Base64"));
    root["images"] = {{{"uri", "../a.png"}}};
    write_text(folder / "a.gltf", root.dump());
    EXPECT_THAT(error_of(read("a.gltf")),
                HasSubstr("its image \"../a.png\" is not in its folder; --texture gives its place"));
}

TEST_F(TextureFile, OneForAllMeshes) {
    for (const char* name_of_mesh : {"a_1.obj", "a_2.obj"}) mesh(name_of_mesh, obj);
    image("skin.png", green);
    image("a_2.png", red);
    const auto files = find_sequence((folder / "a_%d.obj").string());
    auto textures = TextureFiles::open({(folder / "skin.png").string(), {}}, *files);
    ASSERT_TRUE(textures.has_value());
    const auto first = textures->read(0, TextureUse::where_colourless);
    const auto second = textures->read(1, TextureUse::where_colourless);
    EXPECT_EQ(colour_of(first), green);
    EXPECT_EQ(first->texture, second->texture) << "read once";
}

TEST_F(TextureFile, OneForEachMeshByItsNumberElseInOrder) {
    for (const char* name_of_mesh : {"a_07.obj", "a_09.obj"}) mesh(name_of_mesh, obj);
    image("t7.png", red);
    image("t8.png", green);
    image("t9.png", blue);
    EXPECT_EQ(colour_of(read("a_%02d.obj", 1, {"t%d.png", {}})), blue);
    image("u0.png", green);
    image("u1.png", blue);
    EXPECT_EQ(colour_of(read("a_%02d.obj", 0, {"u%d.png", {}})), green);
    image("u2.png", red);
    EXPECT_THAT(
        error_of(read("a_%02d.obj", 0, {"u%d.png", {}})),
        HasSubstr("gives 3 images for 2 meshes, and none has the number 7; give an image for each, or one for all"));
}

TEST_F(TextureFile, IsReadOnlyWhereItIsUsed) {
    mesh("a.obj", std::string("v 0 0 0 1 0 0\n") + obj);  // with a vertex colour
    write_text(folder / "a.png", "nonsense");
    EXPECT_EQ(colour_of(read("a.obj")), Colour{}) << "vertex colours come first";
    EXPECT_EQ(name, (folder / "a.png").string());
    EXPECT_THAT(error_of(read("a.obj", 0, {}, TextureUse::always)), HasSubstr("a.png: this is no PNG, JPEG or WebP"));
    EXPECT_EQ(colour_of(read("a.obj", 0, {}, TextureUse::none)), Colour{});
    image("b.png", blue);
    EXPECT_EQ(colour_of(read("a.obj", 0, {"b.png", {}})), blue) << "the user's choice";
    EXPECT_EQ(colour_of(read("a.obj", 0, {"none", {}})), Colour{});
}

TEST_F(TextureFile, TheOriginTurnsCoordinatesOver) {
    mesh("a.obj", obj);
    image("a.png", red);
    EXPECT_EQ(read("a.obj")->mesh.texcoords[2], (Vector2f{0, 0.75f}));
    EXPECT_EQ(read("a.obj", 0, {"", TextureOrigin::bottom})->mesh.texcoords[2], (Vector2f{0, 0.75f}));
    EXPECT_EQ(read("a.obj", 0, {"", TextureOrigin::top})->mesh.texcoords[2], (Vector2f{0, 0.25f}));
    Mesh triangle = read("a.obj")->mesh;
    ASSERT_TRUE(write_mesh(folder / "a.glb", triangle).has_value());
    EXPECT_EQ(read("a.glb")->mesh.texcoords[2], (Vector2f{0, 0.75f}));
    EXPECT_EQ(read("a.glb", 0, {"", TextureOrigin::top})->mesh.texcoords[2], (Vector2f{0, 0.75f}));
    EXPECT_EQ(read("a.glb", 0, {"", TextureOrigin::bottom})->mesh.texcoords[2], (Vector2f{0, 0.25f}));
}

// Two triangles beside each other, which share an edge in space and lie in different corners of the image.
void write_draco(const fs::path& path, bool from_top) {
    constexpr std::array<Vector3f, 6> positions{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
    constexpr std::array<Vector2f, 6> texcoords{
        {{0.1f, 0.1f}, {0.4f, 0.1f}, {0.1f, 0.4f}, {0.9f, 0.1f}, {0.9f, 0.4f}, {0.6f, 0.4f}}};
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(2);
    const int place = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int texture = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    for (std::uint32_t f = 0; f < 2; ++f) {
        std::array<Vector2f, 3> own;
        for (std::size_t c = 0; c < 3; ++c) {
            own[c] = texcoords[3 * f + c];
            if (from_top) own[c][1] = 1 - own[c][1];
        }
        builder.SetAttributeValuesForFace(place, draco::FaceIndex(f), &positions[3 * f], &positions[3 * f + 1],
                                          &positions[3 * f + 2]);
        builder.SetAttributeValuesForFace(texture, draco::FaceIndex(f), &own[0], &own[1], &own[2]);
    }
    const auto mesh = builder.Finalize();
    draco::Encoder encoder;
    draco::EncoderBuffer buffer;
    ASSERT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    write_bytes(path, {buffer.data(), buffer.data() + buffer.size()});
}

TEST_F(TextureFile, OfDracoFilesTheSeamsTellTheOrigin) {
    // The lower half, where the triangles are, is of one colour; the upper half is not.
    Image image = plain(16, 16, green);
    for (std::size_t i = 0; i < image.rgb.size() / 2; i += 3)
        if (i / 3 % 16 < 8) image.rgb[i] = 255;
    write_bytes(folder / "a.png", *write_png_image(image));
    for (const bool from_top : {false, true}) {
        write_draco(folder / "a.drc", from_top);
        const auto shows_green = [&](const Result<TexturedMesh>& made) {
            EXPECT_TRUE(made.has_value()) << error_of(made);
            const internal::ImagePyramid texture(*made->texture);
            return std::all_of(made->mesh.texcoords.begin(), made->mesh.texcoords.end(),
                               [&](const Vector2f& c) { return std::abs(texture.at(c[0], c[1])[0] - green[0]) < 1; });
        };
        const auto as_found = read("a.drc");
        EXPECT_TRUE(shows_green(as_found)) << from_top;
        EXPECT_FALSE(shows_green(read("a.drc", 0, {"", from_top ? TextureOrigin::bottom : TextureOrigin::top})));
        const auto bare = read("a.drc", 0, {"none", {}});
        EXPECT_EQ(as_found->mesh.texcoords, bare->mesh.texcoords) << "as the file has them";
    }
}

TEST_F(TextureFile, MistakesAreToldInOneSentence) {
    mesh("a.obj", std::string("mtllib a.mtl\nusemtl skin\n") + obj);
    mesh("a.mtl", "newmtl skin\nmap_Kd gone.png\n");
    EXPECT_THAT(
        error_of(read("a.obj")),
        HasSubstr(
            "a.obj: its image \"gone.png\" is not in its folder; --texture gives its place, or none to go on without"));
    mesh("a.mtl", "newmtl skin\nmap_Kd ../../etc/passwd\n");
    EXPECT_THAT(error_of(read("a.obj")), HasSubstr("is not in its folder"));
    EXPECT_THAT(error_of(read("a.obj", 0, {"gone.png", {}})), HasSubstr("--texture: there is no file or folder"));
    EXPECT_THAT(error_of(read("a.obj", 0, {"*.png", {}})),
                HasSubstr("is no image; give one for all frames, or a pattern"));
    mesh("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    image("b.png", red);
    EXPECT_THAT(error_of(read("bare.obj", 0, {"b.png", {}})),
                HasSubstr("bare.obj: the mesh has no texture coordinates"));
    EXPECT_EQ(colour_of(read("bare.obj")), Colour{});
    mesh("alone.obj", obj);
    EXPECT_THAT(error_of(read("alone.obj", 0, {}, TextureUse::always)),
                HasSubstr("alone.obj: no image was found for it"));
}

TEST_F(TextureFile, SeveralImagesOfAMeshAreNotReadHalf) {
    image("a.png", red);
    image("b.png", green);
    mesh("m.mtl", "newmtl one\nmap_Kd a.png\nnewmtl two\nmap_Kd b.png\nnewmtl bare\n");
    const std::string begin = "mtllib m.mtl\nusemtl one\n" + std::string(obj);
    mesh("a.obj", begin + "usemtl two\nf 1/1 3/3 2/2\n");
    EXPECT_THAT(error_of(read("a.obj")), HasSubstr("its parts have 2 images"));
    EXPECT_EQ(colour_of(read("a.obj", 0, {"b.png", {}})), green) << "one that was baked for all";
    mesh("a.obj", begin + "usemtl bare\nf 1/1 3/3 2/2\n");
    EXPECT_THAT(error_of(read("a.obj")), HasSubstr("a part of the mesh has an image and another has none"));
}

}  // namespace
}  // namespace htvm
