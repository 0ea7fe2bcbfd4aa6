#include "io/mesh_file.h"

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "gmock/gmock.h"
#include "io/mesh_samples.h"
#include "io/sequence.h"

namespace htvm {
namespace {

using samples::expect_equal;
using samples::random_mesh;
using testing::StartsWith;

class MeshFile : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_mesh_file_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    std::filesystem::path folder;
};

TEST_F(MeshFile, PlyAndObjReadBackExactly) {
    const Mesh mesh = random_mesh(1, 50, 80);
    for (const char* name : {"a.ply", "a.obj", "B.PLY", "B.Obj"}) {
        ASSERT_TRUE(write_mesh(folder / name, mesh)) << name;
        const auto again = read_mesh(folder / name);
        ASSERT_TRUE(again) << again.error().message;
        expect_equal(*again, mesh);
    }
}

TEST_F(MeshFile, PositionsAreScaledByTheUnit) {
    std::ofstream(folder / "metres.obj") << "v 1 0.5 -0.25\n";
    MeshFileOptions options;
    options.millimetres_per_unit = millimetres_per(LengthUnit::metre);
    const auto mesh = read_mesh(folder / "metres.obj", options);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{1000, 500, -250}}));
    ASSERT_TRUE(write_mesh(folder / "again.obj", *mesh, options));
    EXPECT_EQ(read_mesh(folder / "again.obj")->positions, (std::vector<Vector3f>{{1, 0.5f, -0.25f}}));
    for (const double bad : {0.0, -1.0, 1e300}) {
        options.millimetres_per_unit = bad;
        EXPECT_FALSE(read_mesh(folder / "metres.obj", options)) << bad;
    }
}

TEST_F(MeshFile, ErrorsBeginWithTheNameOfTheFile) {
    std::ofstream(folder / "bad.ply") << "ply\n";
    std::ofstream(folder / "bad.obj") << "f 1 2 3\n";
    std::ofstream(folder / "bad.drc") << "no";
    std::ofstream(folder / "bad.glb") << "glTF";
    std::ofstream(folder / "bad.gltf") << "{}";
    std::ofstream(folder / "bad.stl") << "solid\n";
    std::filesystem::create_directory(folder / "folder.ply");
    for (const char* name :
         {"bad.ply", "bad.obj", "bad.drc", "bad.glb", "bad.gltf", "bad.stl", "absent.ply", "folder.ply"}) {
        const auto mesh = read_mesh(folder / name);
        ASSERT_FALSE(mesh) << name;
        EXPECT_THAT(mesh.error().message, StartsWith((folder / name).string()));
    }
    for (const char* name : {"a.drc", "a.gltf", "a.stl", "a", "absent/a.ply", "absent/a.glb"}) {
        const auto written = write_mesh(folder / name, Mesh());
        ASSERT_FALSE(written) << name;
        EXPECT_THAT(written.error().message, StartsWith((folder / name).string()));
    }
}

TEST_F(MeshFile, GltfIsInMetresByItsFormat) {
    Mesh mesh = random_mesh(1, 50, 80, {.texcoords = false});
    MeshFileOptions metres;
    metres.millimetres_per_unit = millimetres_per(*unit_of_format("a.GLB"));
    for (auto& p : mesh.positions) p = {std::round(p[0]), std::round(p[1]), std::round(p[2])};
    ASSERT_TRUE(write_mesh(folder / "a.glb", mesh, metres));
    const auto again = read_mesh(folder / "a.glb", metres);
    ASSERT_TRUE(again) << again.error().message;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(again->positions[v][i], mesh.positions[v][i], 1e-3);
    EXPECT_EQ(again->triangles, mesh.triangles);
    EXPECT_EQ(again->colours, mesh.colours);
    EXPECT_EQ(unit_of_format("a.gltf"), LengthUnit::metre);
    EXPECT_FALSE(unit_of_format("a.ply"));
}

TEST_F(MeshFile, AFileAboveTheLimitIsNotRead) {
    std::ofstream(folder / "a.txt") << "12345";
    EXPECT_TRUE(read_file(folder / "a.txt", 5));
    const auto bytes = read_file(folder / "a.txt", 4);
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().kind, ErrorKind::limit);
}

TEST(MeantUnit, KnowsUnitsByTheirNamesInAnySpelling) {
    for (const auto* typed : {"meter", "metre", "meters", "Metres", "M"}) EXPECT_EQ(meant_unit(typed), "m") << typed;
    for (const auto* typed : {"millimeter", "millimetres", "MM"}) EXPECT_EQ(meant_unit(typed), "mm") << typed;
    for (const auto* typed : {"centimeters", "centimetre", "cms"}) EXPECT_EQ(meant_unit(typed), "cm") << typed;
    for (const auto* typed : {"inch", "inches"}) EXPECT_EQ(meant_unit(typed), "in") << typed;
    for (const auto* typed : {"foot", "feet"}) EXPECT_EQ(meant_unit(typed), "ft") << typed;
    for (const auto* typed : {"", "parsec", "light years"}) EXPECT_EQ(meant_unit(typed), "") << typed;
    EXPECT_EQ(length_unit("meter").error().message,
              "the unit 'meter' is not one of mm, cm, dm, m, in, ft; did you mean m?");
}

TEST(GuessUnit, GoesByTheDiagonalOfTheBoundingBox) {
    const auto of = [](float x, float y, float z) {
        Mesh mesh;
        mesh.positions = {{1, 1, 1}, {1 + x, 1 + y, 1 + z}};
        return guess_unit(mesh);
    };
    EXPECT_EQ(of(0.5f, 1.8f, 0.3f), LengthUnit::metre);
    EXPECT_EQ(of(50, 180, 30), LengthUnit::centimetre);
    EXPECT_EQ(of(500, 1800, 300), LengthUnit::millimetre);
    EXPECT_EQ(of(0, 0, 599), LengthUnit::centimetre);
    EXPECT_EQ(of(0, 0, 600), LengthUnit::millimetre);
    EXPECT_EQ(of(6, 8, 0), LengthUnit::centimetre);
    EXPECT_EQ(of(0, 0, 0), LengthUnit::millimetre);
    EXPECT_EQ(guess_unit(Mesh()), LengthUnit::millimetre);
}

// The captures are large and not part of the project: HTVM_DATA is the folder that contains them.
TEST(RealCaptures, FirstFramesReadAsDescribed) {
    const char* data = std::getenv("HTVM_DATA");
    if (!data) GTEST_SKIP() << "HTVM_DATA does not name the folder of the captures";
    const std::filesystem::path folder = data;
    if (!std::filesystem::is_directory(folder / "samba")) GTEST_SKIP() << "there is no folder samba in " << data;
    struct Capture {
        const char* name;
        std::size_t fewest, most;  // vertices
        bool colours, normals, texcoords;
        LengthUnit unit;
    };
    for (const Capture& capture : {Capture{"samba", 35000, 39000, true, false, false, LengthUnit::millimetre},
                                   Capture{"liam", 25500, 28000, true, false, false, LengthUnit::millimetre},
                                   Capture{"liam_uv", 31000, 35000, false, true, true, LengthUnit::millimetre},
                                   Capture{"dancer", 19500, 21500, false, false, false, LengthUnit::metre},
                                   Capture{"thomas", 14500, 16600, false, false, false, LengthUnit::metre}}) {
        if (!std::filesystem::is_directory(folder / capture.name)) continue;
        const auto files = find_sequence((folder / capture.name).string());
        ASSERT_TRUE(files) << files.error().message;
        const auto mesh = read_mesh(files->paths[0]);
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_TRUE(check_mesh(*mesh));
        EXPECT_GE(mesh->positions.size(), capture.fewest) << capture.name;
        EXPECT_LE(mesh->positions.size(), capture.most) << capture.name;
        EXPECT_GT(mesh->triangles.size(), mesh->positions.size()) << capture.name;
        EXPECT_EQ(mesh->colours.empty(), !capture.colours) << capture.name;
        EXPECT_EQ(mesh->normals.empty(), !capture.normals) << capture.name;
        EXPECT_EQ(mesh->texcoords.empty(), !capture.texcoords) << capture.name;
        EXPECT_EQ(guess_unit(*mesh), capture.unit) << capture.name;
    }
}

}  // namespace
}  // namespace htvm
