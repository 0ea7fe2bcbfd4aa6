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

// The colour of the mesh's texture, or of its vertices where it has none, at the first corner of each triangle.
std::vector<Colour> colours_of_triangles(const Result<TexturedMesh>& made) {
    std::vector<Colour> out;
    EXPECT_TRUE(made.has_value()) << (made ? "" : made.error().message);
    if (!made) return out;
    for (const auto& triangle : made->mesh.triangles) {
        Colour& colour = out.emplace_back();
        if (!made->texture) {
            if (!made->mesh.colours.empty()) colour = made->mesh.colours[triangle[0]];
            continue;
        }
        const auto& at = made->mesh.texcoords[triangle[0]];
        const auto seen = internal::ImagePyramid(*made->texture).at(at[0], at[1]);
        for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<std::uint8_t>(std::lround(seen[c]));
    }
    return out;
}

std::vector<std::string> abouts(const MeshFindings& findings) {
    std::vector<std::string> out;
    for (const auto& said : findings.remarks) out.push_back(said.about + (said.is_loss ? " (loss)" : ""));
    return out;
}

TEST_F(TextureFile, SeveralImagesOfAMeshGoIntoOne) {
    image("a.png", red);
    image("b.png", green);
    mesh("m.mtl", "newmtl one\nmap_Kd a.png\nnewmtl two\nmap_Kd b.png\nnewmtl bare\nKd 0 0 1\n");
    const std::string begin = "mtllib m.mtl\nusemtl one\n" + std::string(obj);
    mesh("a.obj", begin + "usemtl two\nf 1/1 3/3 2/2\n");
    EXPECT_EQ(colours_of_triangles(read("a.obj")), (std::vector{red, green}));
    EXPECT_EQ(name, (folder / "a.png").string() + " and 1 more");
    EXPECT_EQ(colour_of(read("a.obj", 0, {"b.png", {}})), green) << "one that was baked for all";
    mesh("a.obj", begin + "usemtl bare\nf 1/1 3/3 2/2\n");
    EXPECT_EQ(colours_of_triangles(read("a.obj")), (std::vector{red, Colour{0, 0, 255}}));
    EXPECT_THAT(error_of(read("a.obj", 0, {"", TextureOrigin::by_format, true})),
                HasSubstr("a part of the mesh has an image and another has none; files are kept where one image"));
    mesh("a.obj", begin + "usemtl two\nf 1/1 3/3 2/2\n");
    EXPECT_THAT(error_of(read("a.obj", 0, {"", TextureOrigin::by_format, true})),
                HasSubstr("its parts have 2 images;"));
    fs::remove(folder / "b.png");
    EXPECT_THAT(error_of(read("a.obj")),
                HasSubstr("its image \"b.png\", of its material \"two\", is not in its folder; its 2 images belong "
                          "there: --texture gives one in place of all of them, or none to go on without"));
}

TEST_F(TextureFile, OneImageForPartsThatHaveTheirOwnIsTold) {
    image("a.png", red);
    mesh("m.mtl", "newmtl one\nmap_Kd a.png\nnewmtl two\nmap_Kd b.png\nnewmtl alike\nmap_Kd a.png\n");
    const auto said_of = [&](const std::string& second) {
        mesh("a.obj", "mtllib m.mtl\nusemtl one\n" + std::string(obj) + "usemtl " + second + "\nf 1/1 3/3 2/2\n");
        auto textures =
            TextureFiles::open({(folder / "a.png").string(), {}}, *find_sequence((folder / "a.obj").string()));
        EXPECT_TRUE(textures->read(0, TextureUse::where_colourless).has_value());
        return textures->findings();
    };
    const auto two = said_of("two");
    EXPECT_THAT(abouts(two), testing::ElementsAre("one-image-for-all (loss)"));
    EXPECT_EQ(two.remarks[0].text,
              "its parts have 2 images of their own; the one of --texture stands in for all of them");
    EXPECT_THAT(abouts(said_of("alike")), testing::IsEmpty()) << "one image for all is what the mesh says too";
}

TEST_F(TextureFile, FramesWithTheSameImagesShareTheirAtlas) {
    image("a.png", red);
    image("b.png", green);
    mesh("m.mtl", "newmtl one\nmap_Kd a.png\nnewmtl two\nmap_Kd b.png\n");
    const std::string vertices = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\n";
    mesh("f1.obj", vertices + "usemtl one\nf 1/1 2/2 3/3\nusemtl two\nf 1/1 3/3 2/2\n");
    mesh("f2.obj", vertices + "usemtl two\nf 1/1 3/3 2/2\nusemtl one\nf 1/1 2/2 3/3\n");
    auto textures = TextureFiles::open({}, *find_sequence((folder / "f%d.obj").string()));
    const auto first = textures->read(0, TextureUse::where_colourless);
    const auto second = textures->read(1, TextureUse::where_colourless);
    EXPECT_EQ(colours_of_triangles(first), (std::vector{red, green}));
    EXPECT_EQ(colours_of_triangles(second), (std::vector{green, red})) << "in whichever order the materials come";
    EXPECT_EQ(first->texture, second->texture);
}

TEST_F(TextureFile, ColoursOfMaterialsAreThoseOfVertices) {
    mesh("m.mtl", "newmtl one\nKd 1 0 0\nnewmtl two\nKd 0 0 1\nnewmtl grey\nKd 0.8 0.8 0.8\n");
    const std::string vertices = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\n";
    mesh("a.obj", vertices + "usemtl one\nf 1 2 3\nusemtl two\nf 4 5 6\n");
    EXPECT_EQ(colours_of_triangles(read("a.obj")), (std::vector{Colour{255, 0, 0}, Colour{0, 0, 255}}));
    mesh("a.obj", vertices + "usemtl grey\nf 1 2 3\nf 4 5 6\n");
    EXPECT_TRUE(read("a.obj")->mesh.colours.empty()) << "a grey that programs write where none was chosen";
    mesh("a.obj", "v 0 0 0 0 1 0\nv 1 0 0 0 1 0\nv 0 1 0 1 1 0\nmtllib m.mtl\nusemtl one\nf 1 2 3\n");
    EXPECT_EQ(colours_of_triangles(read("a.obj")), (std::vector{Colour{0, 255, 0}})) << "vertices' own come first";
}

TEST_F(TextureFile, MaterialFilesAreFoundAsProgramsNameThem) {
    image("tex.png", green);
    mesh("take #3.mtl", "newmtl skin\nmap_Kd TEX.PNG\n");
    mesh("other.mtl", "newmtl other\nKd 1 0 0\n");
    fs::create_directories(folder / "materials");
    image("materials/own.png", blue);
    mesh("materials/own.mtl", "newmtl skin\nmap_Kd own.png\n");
    const auto with = [&](const std::string& lines) {
        mesh("a.obj", lines + "\nusemtl skin\n" + obj);
        return colour_of(read("a.obj"));
    };
    EXPECT_EQ(with("mtllib other.mtl\nmtllib ./TAKE #3.mtl"), green);
    EXPECT_EQ(with("mtllib other.mtl take #3.mtl"), green);
    EXPECT_EQ(with("mtllib \"take #3.mtl\""), green);
    EXPECT_EQ(with("mtllib take%20%233.mtl"), green);
    EXPECT_EQ(with("mtllib materials/own.mtl"), blue) << "its images lie beside it";
}

TEST_F(TextureFile, MaterialsThatAreNotThereAreTold) {
    const auto said_of = [&](const std::string& lines) {
        mesh("a.obj", lines + "\nusemtl skin\n" + obj);
        auto textures = TextureFiles::open({}, *find_sequence((folder / "a.obj").string()));
        EXPECT_TRUE(textures->read(0, TextureUse::where_colourless).has_value());
        return textures->findings();
    };
    mesh("m.mtl", "newmtl hair\n");
    const auto missing = said_of("mtllib gone.mtl");
    EXPECT_THAT(abouts(missing), testing::ElementsAre("material-file (loss)", "no-image"));
    EXPECT_EQ(missing.remarks[0].text, "its material file \"gone.mtl\" is not in its folder (" + folder.string() + ")");
    const auto unknown = said_of("mtllib m.mtl");
    EXPECT_THAT(abouts(unknown), testing::ElementsAre("material (loss)", "no-image"));
    EXPECT_EQ(unknown.remarks[0].text, "its material \"skin\" is in none of its material files");
    mesh("m.mtl", "newmtl skin\nmap_Ka a.png\n");
    image("a.png", red);
    EXPECT_THAT(abouts(said_of("mtllib m.mtl")), testing::ElementsAre("substitute-image"));
    mesh("m.mtl", "newmtl skin\nmap_Kd -s 2 2 2 a.png\n");
    EXPECT_THAT(abouts(said_of("mtllib m.mtl")), testing::ElementsAre("placed-image"));
    EXPECT_THAT(abouts(said_of("mtllib gone.mtl")), testing::ElementsAre("material-file"))
        << "the image beside it is taken";
}

TEST_F(TextureFile, OneColourAtAllVerticesIsNoReasonAgainstTheImage) {
    const std::string rest = "vt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n";
    mesh("a.obj", "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + rest);
    EXPECT_EQ(read("a.obj")->mesh.colours, (std::vector<Colour>(3, {255, 255, 255}))) << "without an image it stays";
    image("a.png", red);
    EXPECT_EQ(colour_of(read("a.obj")), red);
    EXPECT_TRUE(read("a.obj")->mesh.colours.empty());
    mesh("a.obj", "v 0 0 0 1 1 0\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + rest);
    EXPECT_EQ(colour_of(read("a.obj")), Colour{}) << "different ones come first";
}

TEST_F(TextureFile, ColoursThatMultiplyTheImageStayWithIt) {
    image("a.png", {255, 128, 128});
    const auto read_with = [&](const std::vector<Colour>& colours) {
        Mesh triangle;
        triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        triangle.texcoords = {{0, 0}, {1, 0}, {0, 0.75f}};
        triangle.triangles = {{0, 1, 2}};
        triangle.colours = colours;
        MeshFindings findings;
        findings.texture.images = {{"a", *read_file(folder / "a.png")}};
        findings.texture.parts = {{{}, 0, Colour{255, 255, 0}}};
        findings.texture.colours_multiply = true;
        auto textures = TextureFiles::open({});
        return textures->with_image(triangle, 0, findings, TextureUse::where_colourless);
    };
    const auto constant = read_with({{128, 255, 255}, {128, 255, 255}, {128, 255, 255}});
    EXPECT_EQ(colour_of(constant), (Colour{128, 128, 0})) << "one for all is part of the image";
    EXPECT_TRUE(constant->mesh.colours.empty());
    const std::vector<Colour> different{{255, 255, 255}, {128, 255, 255}, {0, 255, 255}};
    const auto kept = read_with(different);
    EXPECT_EQ(colour_of(kept), (Colour{255, 128, 0}));
    EXPECT_EQ(kept->mesh.colours, different);
}

TEST_F(TextureFile, ImagesThatAreTooLargeAreMadeSmaller) {
    write_bytes(folder / "a.png", *write_png_image(plain(8192, 16, red)));
    mesh("a.obj", obj);
    auto textures = TextureFiles::open({}, *find_sequence((folder / "a.obj").string()));
    const auto made = textures->read(0, TextureUse::where_colourless);
    EXPECT_EQ(colour_of(made), red);
    EXPECT_EQ(made->texture->width, 4096);
    EXPECT_EQ(made->texture->height, 8);
    EXPECT_THAT(abouts(textures->findings()), testing::ElementsAre("image-size"));
    EXPECT_THAT(error_of(read("a.obj", 0, {"", TextureOrigin::by_format, true})),
                HasSubstr("8192 x 16 pixels, more than"));
}

TEST_F(TextureFile, DamagedImagesAreToldOnceForEachMesh) {
    Image noise = plain(64, 64, red);
    for (std::size_t i = 0; i < noise.rgb.size(); ++i)
        noise.rgb[i] = static_cast<std::uint8_t>(i * i * 2654435761u >> 13);
    auto jpeg = *write_jpeg_image(noise);
    jpeg.resize(jpeg.size() * 6 / 10);
    write_bytes(folder / "a.jpg", jpeg);
    mesh("a.obj", obj);
    auto textures = TextureFiles::open({}, *find_sequence((folder / "a.obj").string()));
    for (int reading = 0; reading < 2; ++reading) {
        ASSERT_TRUE(textures->read(0, TextureUse::where_colourless).has_value());
        EXPECT_THAT(abouts(textures->findings()), testing::ElementsAre("image-damage (loss)"));
        EXPECT_THAT(textures->findings().remarks[0].text, HasSubstr("a.jpg) is cut off: the last "));
    }
}

TEST_F(TextureFile, SizesAndKindsMayChangeFromFrameToFrame) {
    for (const char* file : {"f1.obj", "f2.obj", "f3.obj"}) mesh(file, obj);
    write_bytes(folder / "f1.png", *write_png_image(plain(8, 4, red)));
    write_bytes(folder / "f2.jpg", *write_jpeg_image(plain(16, 16, green)));
    write_bytes(folder / "f3.webp", samples::webp_of(plain(5, 9, blue)));
    EXPECT_EQ(colour_of(read("f%d.obj", 0)), red);
    EXPECT_NEAR(colour_of(read("f%d.obj", 1))[1], green[1], 3);
    EXPECT_EQ(read("f%d.obj", 1)->texture->width, 16);
    EXPECT_EQ(colour_of(read("f%d.obj", 2)), blue);
}

}  // namespace
}  // namespace htvm
