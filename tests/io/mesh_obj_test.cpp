#include "gmock/gmock.h"
#include "io/mesh_samples.h"
#include "io/obj.h"

namespace htvm {
namespace {

using samples::expect_equal;
using samples::random_mesh;
using testing::HasSubstr;

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ObjReading, PolygonsBecomeFansAndIsolatedVerticesAndDegenerateTrianglesStay) {
    const auto mesh = read_obj("# a square\nmtllib a.mtl\no x\n" + square +
                               "v 9 9 9\ng y\nusemtl z\ns 1\nf 2 3 4 1\nf 1 2\nf 1 1 2\nl 1 2\nf 3 2 1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {9, 9, 9}}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}, {0, 0, 1}, {2, 1, 0}}));
    EXPECT_TRUE(mesh->colours.empty() && mesh->normals.empty() && mesh->texcoords.empty());
}

TEST(ObjReading, APolygonMayHaveMoreThan255Corners) {
    std::string text;
    std::string face = "f";
    for (int i = 1; i <= 1000; ++i) {
        const std::string number = std::to_string(i);
        text += "v " + number + " 0 0\n";
        face += ' ';
        face += number;
    }
    const auto mesh = read_obj(text + face);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->triangles.size(), 998u);
    EXPECT_EQ(mesh->triangles.back(), (Triangle{0, 998, 999}));
}

TEST(ObjReading, NegativeIndicesCountBackFromTheLastSoFar) {
    const auto mesh = read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\r\nf -4/ -2// \\\r\n-1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(ObjReading, VertexColoursAre0To1OrPlainly0To255) {
    const auto unit = read_obj("v 0 0 0 0 0.5 1\nv 0 0 0\nv 0 0 0 1 2\n");
    ASSERT_TRUE(unit);
    EXPECT_EQ(unit->colours, (std::vector<Colour>{{0, 128, 255}, {255, 255, 255}, {255, 255, 255}}));
    const auto bytes = read_obj("v 0 0 0 0 1 200\nv 0 0 0 0 17 300\n");
    ASSERT_TRUE(bytes);
    EXPECT_EQ(bytes->colours, (std::vector<Colour>{{0, 1, 200}, {0, 17, 255}}));
}

TEST(ObjReading, AVertexIsSplitOnlyWhereItsCornersDiffer) {
    const std::string texcoords = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\nvt 1 0\n";
    // vt 6 equals vt 2, so it splits nothing; vt 5 at position 3 does.
    const auto mesh = read_obj(square + texcoords + "f 1/1 2/2 3/3\nf 1/1 2/6 3/5\nf 3/5 4/4 1/1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 1, 0}}));
    EXPECT_EQ(mesh->texcoords, (std::vector<Vector2f>{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5f, 0.5f}}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 4}, {4, 3, 0}}));
}

TEST(ObjReading, SplitVerticesKeepTheirColourAndCornersMayLackAttributes) {
    const auto mesh = read_obj(
        "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvn 0 0 1\nvn 0 1 0\nvt 0.5\n"
        "f 1//1 2//1 3/1/1\nf 1//2 3 2//1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 1}}));
    EXPECT_EQ(mesh->colours, (std::vector<Colour>{{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 0, 0}, {0, 0, 255}}));
    EXPECT_EQ(mesh->normals, (std::vector<Vector3f>{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 1, 0}, {0, 0, 0}}));
    EXPECT_EQ(mesh->texcoords, (std::vector<Vector2f>{{0, 0}, {0, 0}, {0.5f, 0}, {0, 0}, {0, 0}}));
}

TEST(ObjReading, ErrorsNameTheLine) {
    for (const std::string bad : {"f 1 2 5", "f 1 2 0", "f 1 2 -5", "f 1 2 x", "f 1/x 2/1 3/1", "f 1/2/3/4 1 1",
                                  "f 1 2 99999999999999999999", "v 1 2", "v a b c", "v 1 2 1,2,3", "vn 1 2", "vt",
                                  "vt x", "f 1 2 4294967297", "f 1 2 4294967296", "f 1 2 4294967295"}) {
        const auto mesh = read_obj(square + bad + "\nf 1 2 3\n");
        ASSERT_FALSE(mesh) << bad;
        EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
        EXPECT_THAT(mesh.error().message, HasSubstr("line 5 ")) << bad;
    }
}

TEST(ObjReading, LimitsAreErrorsOfTheirOwnKind) {
    const auto mesh = read_obj(square, {{3, 100}});
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().kind, ErrorKind::limit);
}

TEST(ObjReading, NoTextIsNoMesh) {
    const auto mesh = read_obj("");
    ASSERT_TRUE(mesh);
    EXPECT_TRUE(mesh->positions.empty());
}

TEST(ObjReading, DamagedTextGivesAMeshOrAnError) {
    const auto whole = write_obj(random_mesh(4, 12, 15));
    ASSERT_TRUE(whole);
    std::mt19937 random(5);
    const std::string alphabet = "0123456789-+./ \nvfnt#\\e\r\t";
    for (int trial = 0; trial < 5000; ++trial) {
        std::string damaged = whole->substr(0, random() % whole->size());
        for (int hit = 0; hit < 3 && !damaged.empty(); ++hit) {
            damaged[random() % damaged.size()] = alphabet[random() % alphabet.size()];
        }
        if (const auto mesh = read_obj(damaged)) {
            EXPECT_TRUE(check_mesh(*mesh));
        }
    }
}

TEST(ObjWriting, ReadsBackExactlyWithAnySetOfAttributes) {
    for (unsigned seed = 0; seed < 8; ++seed) {
        for (const std::size_t vertices : {0, 1, 2, 100}) {
            const Mesh mesh =
                random_mesh(seed, vertices, vertices * 2 / 3, {(seed & 1) != 0, (seed & 2) != 0, (seed & 4) != 0});
            const auto text = write_obj(mesh);
            ASSERT_TRUE(text);
            const auto again = read_obj(*text);
            ASSERT_TRUE(again) << again.error().message;
            expect_equal(*again, mesh);
        }
    }
}

TEST(ObjWriting, EveryColourLevelReadsBack) {
    Mesh mesh;
    for (int c = 0; c < 256; ++c) {
        mesh.positions.push_back({0, 0, 0});
        mesh.colours.push_back({static_cast<std::uint8_t>(c), 255, 0});
    }
    const auto again = read_obj(*write_obj(mesh));
    ASSERT_TRUE(again);
    EXPECT_EQ(again->colours, mesh.colours);
}

TEST(ObjWriting, TheTextOfASmallMeshIsThis) {
    Mesh mesh;
    mesh.positions = {{1, 0.5f, -2}};
    mesh.colours = {{0, 51, 255}};
    mesh.normals = {{0, 0, 1}};
    mesh.triangles = {{0, 0, 0}};
    EXPECT_EQ(*write_obj(mesh), "v 1 0.5 -2 0 0.2 1\nvn 0 0 1\nf 1//1 1//1 1//1\n");
    mesh.texcoords = {{0.25f, 1}};
    EXPECT_EQ(*write_obj(mesh), "v 1 0.5 -2 0 0.2 1\nvt 0.25 1\nvn 0 0 1\nf 1/1/1 1/1/1 1/1/1\n");
}

TEST(ObjReading, AnotherKindOfTextIsNoEmptyMesh) {
    const auto prose = read_obj("Dear diary,\ntoday I captured a dancer.\n");
    ASSERT_FALSE(prose.has_value());
    EXPECT_EQ(prose.error().kind, ErrorKind::bad_input);
    EXPECT_NE(prose.error().message.find("line 1"), std::string::npos) << prose.error().message;
    EXPECT_TRUE(read_obj("# nothing\no empty\ng none\n").has_value()) << "an OBJ without a vertex is an empty mesh";
    EXPECT_TRUE(read_obj("").has_value());
}

const std::string triangle_text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + by.size()))
        text.replace(at, what.size(), by);
    return text;
}

TEST(ObjReading, LinesEndInAnyWayAndBlanksAreOfAnyKind) {
    const std::string commented = "# C:\\made by\\\n" + triangle_text;
    for (const std::string& text :
         {replaced(commented, "\n", "\r"), replaced(commented, "\n", "\r\n"), replaced(commented, "\n", "\n\r"),
          replaced(commented, " ", "\t"), "\xef\xbb\xbf" + commented, commented + "\x1a", commented + "\f\n",
          "\n\n" + commented, commented.substr(0, commented.size() - 1),
          replaced(commented, "2 3\n", "2 3#the only one\n"), commented + std::string(3, '\0'),
          replaced(commented, "v 1 ", "v +1 "), replaced(commented, "f 1 2", "f 1 \\\r\n 2"),
          replaced(commented, "v 1 1 0", "v 1,0 1,00 0 # a decimal comma")}) {
        const auto mesh = read_obj(text);
        ASSERT_TRUE(mesh) << text << mesh.error().message;
        EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}})) << text;
        EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}})) << text;
    }
    const auto bad = read_obj("v 0 0 0\r\r\nv x\r");
    ASSERT_FALSE(bad);
    EXPECT_THAT(bad.error().message, HasSubstr("line 3 "));
}

TEST(ObjReading, PositionsMayHaveAWeightOrAnAlpha) {
    MeshFindings findings;
    const auto mesh = read_obj("v 1 2 3 1\nv 4 5 6 1 0 0\nv 7 8 9 0 1 0 0.5\n", {}, &findings);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    EXPECT_EQ(mesh->colours, (std::vector<Colour>{{255, 255, 255}, {255, 0, 0}, {0, 255, 0}}));
    EXPECT_TRUE(findings.remarks.empty());
    ASSERT_TRUE(read_obj("v 1 2 3 0.5\n", {}, &findings));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "weights");
}

TEST(ObjReading, ReferencesToTexcoordsAndNormalsThatAreNotThereAreLeftOut) {
    MeshFindings findings;
    const auto none = read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1/1 2/2/2 3/-1/99999999999999999999\n", {}, &findings);
    ASSERT_TRUE(none) << none.error().message;
    EXPECT_TRUE(none->texcoords.empty() && none->normals.empty());
    ASSERT_EQ(findings.remarks.size(), 2u);
    EXPECT_EQ(findings.remarks[0].about, "missing-texcoords");
    EXPECT_EQ(findings.remarks[1].about, "missing-normals");
    EXPECT_FALSE(findings.remarks[0].is_loss || findings.remarks[1].is_loss);
    const auto some = read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 1\nf 1/1 2/0 3/2\n", {}, &findings);
    ASSERT_TRUE(some) << some.error().message;
    EXPECT_EQ(some->texcoords, (std::vector<Vector2f>{{0.5f, 1}, {0, 0}, {0, 0}}));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_TRUE(findings.remarks[0].is_loss);
}

TEST(ObjReading, FacesOfFewerThanThreeCornersAreSkippedWhateverTheyReferTo) {
    const auto mesh = read_obj(triangle_text + "f\nf 1\nf 1 77\n");
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->triangles.size(), 1u);
}

TEST(ObjReading, ThePartsAreTheMaterialsInTheOrderOfTheirFirstUse) {
    MeshFindings findings;
    const auto mesh = read_obj(square +
                                   "usemtl never\nusemtl b # 2 \nf 1 2 3 4\nmtllib take #3.mtl  more.mtl\t\n"
                                   "usemtl\nf 1 2 3\nusemtl b # 2\nf 2 3 4\nmtllib\n",
                               {}, &findings);
    ASSERT_TRUE(mesh);
    const auto& texture = findings.texture;
    ASSERT_EQ(texture.parts.size(), 2u);
    EXPECT_EQ(texture.parts[0].material, "b # 2");
    EXPECT_EQ(texture.parts[1].material, "");
    EXPECT_EQ(texture.part_of_triangle, (std::vector<std::uint16_t>{0, 0, 1, 0}));
    EXPECT_EQ(texture.material_files, (std::vector<std::string>{"take #3.mtl  more.mtl"}));
    ASSERT_TRUE(read_obj("usemtl one\n" + triangle_text, {}, &findings));
    EXPECT_EQ(findings.texture.parts.size(), 1u);
    EXPECT_TRUE(findings.texture.part_of_triangle.empty());
}

TEST(ObjReading, MoreMaterialsThanPartsCanBeAreALimit) {
    for (const int materials : {65535, 65536}) {
        std::string text = square;
        for (int m = 0; m < materials; ++m) text += "usemtl " + std::to_string(m) + "\nf 1 2 3\n";
        const auto mesh = read_obj(text);
        ASSERT_EQ(mesh.has_value(), materials == 65535);
        if (!mesh) {
            EXPECT_EQ(mesh.error().kind, ErrorKind::limit);
        }
    }
}

TEST(ObjReading, PositionsThatAreNotFiniteAreLeftOutWhereTheyAreFew) {
    std::string text;
    for (int v = 0; v < 20; ++v) text += "v " + std::to_string(v) + " 0 " + std::to_string(v % 2) + " 1 0 0\n";
    std::string faces;
    for (int f = 1; f < 19; ++f)
        faces += "f " + std::to_string(f) + " " + std::to_string(f + 1) + " " + std::to_string(f + 2) + "\n";
    MeshFindings findings;
    const auto unused = read_obj("v nan 0 0 1 0 0\n" + text + "v 1.#QNAN -1.#IND00 1.#INF\n", {}, &findings);
    ASSERT_TRUE(unused) << unused.error().message;
    EXPECT_EQ(unused->positions.size(), 20u);
    EXPECT_EQ(unused->positions[0], (Vector3f{0, 0, 0}));
    EXPECT_EQ(unused->colours.size(), 20u);
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "not-finite");
    EXPECT_THAT(findings.remarks[0].text, HasSubstr("2 vertices"));
    EXPECT_FALSE(findings.remarks[0].is_loss);
    const auto used = read_obj(replaced(text, "v 0 0 0", "v -nan(ind) 0 0") + faces, {}, &findings);
    ASSERT_TRUE(used) << used.error().message;
    EXPECT_EQ(used->positions.size(), 19u);
    EXPECT_EQ(used->triangles.size(), 17u);
    EXPECT_EQ(used->triangles[0], (Triangle{0, 1, 2}));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "not-finite-triangles");
    EXPECT_TRUE(findings.remarks[0].is_loss);
    const auto many = read_obj(square + "v 1e39 0 0\nf 1 2 3\nf 3 4 5\n");
    ASSERT_FALSE(many);
    EXPECT_THAT(many.error().message, HasSubstr("vertex 4 "));
    EXPECT_FALSE(read_obj("v nan 0 0\nv nan 0 0\n")) << "nothing is left";
}

TEST(ObjReading, TheOriginIsTakenOffBeforePositionsBecomeFloats) {
    const MeshReadOptions options{.limits = {}, .origin = {4075539.5, -1, 0}};
    const auto mesh = read_obj("v 4075539.501 0.25 0.1\nv 1e300 0 0\n", options);
    ASSERT_TRUE(mesh);
    ASSERT_EQ(mesh->positions.size(), 1u);
    EXPECT_FLOAT_EQ(mesh->positions[0][0], static_cast<float>(4075539.501 - 4075539.5));
    EXPECT_EQ(mesh->positions[0][1], 1.25f);
}

TEST(ObjReading, ColoursTakeTheRangeOfTheOptions) {
    MeshFindings findings;
    const std::string dark = "v 0 0 0 0.5 1 0\n";
    EXPECT_EQ(read_obj(dark, {}, &findings)->colours[0], (Colour{128, 255, 0}));
    EXPECT_EQ(findings.colour_levels.up_to_unit, 2u);
    EXPECT_EQ(read_obj(dark, {.limits = {}, .colour_range = ColourRange::bytes})->colours[0], (Colour{1, 1, 0}));
    const auto outlier = read_obj("v 0 0 0 1 1 1\nv 0 0 0 1 1 1\nv 0 0 0 1 1 1\nv 0 0 0 1 1 77\n");
    EXPECT_EQ(outlier->colours[0], (Colour{255, 255, 255})) << "one value beyond the range does not decide";
}

TEST(ObjReading, ConcaveFacesAreCutWithinThemselves) {
    const auto mesh =
        read_obj("v 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nv 0 0 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1 4/1\nf 1/2 2/2 4/2\n");
    ASSERT_TRUE(mesh);
    ASSERT_EQ(mesh->triangles.size(), 3u);
    for (const auto& triangle : {mesh->triangles[0], mesh->triangles[1]})
        EXPECT_TRUE(std::ranges::count(triangle, 1u) == 1 && std::ranges::count(triangle, 3u) == 1);
}

}  // namespace
}  // namespace htvm
