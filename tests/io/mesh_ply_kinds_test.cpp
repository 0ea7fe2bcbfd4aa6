// PLY files as the many programs that write them do.
#include <algorithm>
#include <bit>
#include <cstring>
#include <sstream>

#include "gmock/gmock.h"
#include "io/mesh_samples.h"
#include "io/ply.h"

namespace htvm {
namespace {

using samples::bytes_of;
using samples::expect_equal;
using samples::random_mesh;
using samples::text_of;
using testing::HasSubstr;

Result<Mesh> read(const std::string& text, MeshFindings* findings = nullptr, const MeshReadOptions& options = {}) {
    return read_ply(bytes_of(text), options, findings);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + by.size()))
        text.replace(at, what.size(), by);
    return text;
}

// The bits of a number in a binary file of little-endian order.
template <class T>
std::string little(T value) {
    std::string out(sizeof value, '\0');
    std::memcpy(out.data(), &value, sizeof value);
    return out;
}

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
// An ASCII file of vertices with more properties.
std::string points(std::size_t count, const std::string& properties, const std::string& lines) {
    return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) + "\n" + xyz + properties + "end_header\n" +
           lines;
}
// An ASCII file of the corners 0 0, 1 0, 1 1, 0 1 and faces with more properties.
std::string square(std::size_t count, const std::string& properties, const std::string& lines,
                   const std::string& comments = {}) {
    return "ply\nformat ascii 1.0\n" + comments + "element vertex 4\n" + xyz + "element face " + std::to_string(count) +
           "\nproperty list uchar int vertex_indices\n" + properties + "end_header\n" + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n" +
           lines;
}

// A binary file whose data begin with a byte of any value, and the same with another line end.
struct BinarySample {
    std::string header, data;
    Mesh mesh;
};
BinarySample binary_sample(int first_byte) {
    BinarySample out;
    out.mesh = random_mesh(3, 5, 4, {true, false, false});
    const auto bits =
        (std::bit_cast<std::uint32_t>(out.mesh.positions[0][0]) & ~0xffu) | static_cast<unsigned>(first_byte);
    out.mesh.positions[0][0] = std::bit_cast<float>(bits);
    const std::string whole = text_of(*write_ply(out.mesh));
    const auto cut = whole.find("end_header\n") + 11;
    out.header = whole.substr(0, cut);
    out.data = whole.substr(cut);
    return out;
}

TEST(PlyKinds, LinesOfTheHeaderEndInAnyWayWhateverByteFollows) {
    for (const int first_byte : {10, 13, 32, 0}) {
        const auto [header, data, mesh] = binary_sample(first_byte);
        for (const std::string end : {"\n", "\r\n", "\r", "\n\r", "\r\r\n", " \n", "\t \r\n"}) {
            // An LF that follows a CR alone belongs to the data, a CR that follows an LF too unless lines end so.
            if (end == "\n" && first_byte == 13) continue;
            const std::string one = replaced(header, "\n", end) + data;
            const auto alone = read(one);
            ASSERT_TRUE(alone) << first_byte << testing::PrintToString(end) << alone.error().message;
            expect_equal(*alone, mesh);
            std::istringstream stream(one + one);
            PlyStreamReader reader(stream);
            for (int n = 1; n < 3; ++n) {
                const auto next = reader.next();
                ASSERT_TRUE(next && *next) << first_byte << testing::PrintToString(end);
                expect_equal(**next, mesh);
                EXPECT_EQ(static_cast<std::size_t>(stream.tellg()), static_cast<std::size_t>(n) * one.size());
            }
        }
    }
    const auto [header, data, mesh] = binary_sample(13);
    const auto plain = read(header + data);
    ASSERT_TRUE(plain);
    expect_equal(*plain, mesh);
}

TEST(PlyKinds, HeadersAreReadAsLooselyAsProgramsWriteThem) {
    const auto [header, data, mesh] = binary_sample(1);
    const std::string mark = "\xef\xbb\xbf";
    for (const std::string& head :
         {mark + header, "\n \t" + header, replaced(header, " ", "\t"), replaced(header, "ply\n", "PLY  \n"),
          replaced(header, "element vertex ", "element vertex    000"), replaced(header, " 1.0\n", "\n"),
          replaced(header, " 1.0\n", " 1\n"), replaced(header, "property", "PROPERTY"),
          replaced(header, "property", "  Property"), replaced(header, "float x", "Float X"),
          replaced(header, "element vertex", "ELEMENT Vertex"), replaced(header, "property float", "float"),
          replaced(replaced(header, "property uchar", "uint8"), "property list", "list"),
          replaced(header, "ply\n", "ply\n\ncomment\nobj_info a b\n\n"),
          replaced(header, "end_header", "\ncomment element vertex 9\nEND_HEADER  "),
          replaced(replaced(header, "uchar", "uint8"), "uint ", "uint32 "), replaced(header, "float", "float32"),
          replaced(replaced(header, "uint ", "int32 "), "uchar", "int8")}) {
        const auto alone = read(head + data);
        ASSERT_TRUE(alone) << head << alone.error().message;
        expect_equal(*alone, mesh);
    }
    EXPECT_FALSE(read(replaced(header, "property float x", "x float") + data));
    EXPECT_FALSE(read("plyo\n" + header.substr(4) + data));
}

TEST(PlyKinds, TextBodiesMayHaveCommentsEmptyLinesAndDecimalCommas) {
    const std::string text = square(2, "", "3 0 1 2\n3 0 2 3\n");
    const auto plain = read(text);
    ASSERT_TRUE(plain);
    for (const std::string& other :
         {replaced(text, "\n", "\r"), replaced(text, "\n", "\r\n"), replaced(text, "\n", "\n\r"),
          replaced(text, "end_header\n", "end_header\n\ncomment data follow\n"),
          replaced(text, "1 1 0\n", "1 1 0\n\ncomment 1 2 3\n# more\nobj_info\n"),
          replaced(text, "1 1 0", "1,0 1,00 0"), replaced(text, "1 1 0", "+1 1e0 .0"), text.substr(0, text.size() - 1),
          replaced(text, " ", " \t ")}) {
        const auto mesh = read(other);
        ASSERT_TRUE(mesh) << other << mesh.error().message;
        expect_equal(*mesh, *plain);
        std::istringstream stream(other + "\n" + other);
        PlyStreamReader reader(stream);
        for (int n = 0; n < 2; ++n) {
            const auto next = reader.next();
            ASSERT_TRUE(next && *next) << other;
            expect_equal(**next, *plain);
        }
        EXPECT_FALSE(reader.next().value());
    }
    EXPECT_FALSE(read(replaced(text, "1 1 0", "1,0,0 1 0")));
    EXPECT_FALSE(read(replaced(text, "1 1 0", "1,000.0 1 0")));
}

TEST(PlyStream, ZerosAndEmptyLinesMayStandBetweenMeshes) {
    const auto [header, data, mesh] = binary_sample(1);
    const std::string one = header + data;
    std::istringstream stream(one + std::string(4096, '\0') + one + "\r\n\n" + one + "\xef\xbb\xbf" + one + "\x1a");
    PlyStreamReader reader(stream);
    for (int n = 0; n < 4; ++n) {
        const auto next = reader.next();
        ASSERT_TRUE(next && *next) << n;
        expect_equal(**next, mesh);
    }
    const auto end = reader.next();
    ASSERT_TRUE(end);
    EXPECT_FALSE(*end);
    EXPECT_FALSE(read(one + std::string(3, '\0') + one)) << "a file with several meshes is not one mesh";
    EXPECT_TRUE(read(one + std::string(3, '\0')));
}

TEST(PlyKinds, NumbersOf64BitsAreRead) {
    const auto mesh = read(
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty int64 x\nproperty uint64 y\nproperty long z\n"
        "element face 1\nproperty list uint64 int64 vertex_indices\nend_header\n" +
        little<std::int64_t>(-5) + little<std::uint64_t>(7) + little<std::int64_t>(1) + std::string(48, '\0') +
        little<std::uint64_t>(3) + little<std::int64_t>(2) + little<std::int64_t>(1) + little<std::int64_t>(0));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions[0], (Vector3f{-5, 7, 1}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{2, 1, 0}}));
}

TEST(PlyKinds, ColoursAre0To1Or0To255Or0To65535ByTheirBulk) {
    const auto colours_of = [](const std::string& type, const std::string& values,
                               const MeshReadOptions& options = {}) {
        std::string properties;
        for (const std::string name : {"red", "green", "blue"}) properties += "property " + type + " " + name + "\n";
        MeshFindings findings;
        const auto mesh = read(points(1, properties, "0 0 0 " + values + "\n"), &findings, options);
        EXPECT_TRUE(mesh);
        EXPECT_EQ(findings.colour_levels.any(), type != "uchar" && type != "char") << type;
        return mesh->colours[0];
    };
    EXPECT_EQ(colours_of("float", "0 0.5 1"), (Colour{0, 128, 255}));
    EXPECT_EQ(colours_of("double", "7 128 255"), (Colour{7, 128, 255}));
    EXPECT_EQ(colours_of("ushort", "0 257 65535"), (Colour{0, 1, 255}));
    EXPECT_EQ(colours_of("ushort", "1 128 255"), (Colour{1, 128, 255}));
    EXPECT_EQ(colours_of("int", "1 0 1"), (Colour{1, 0, 1})) << "whole numbers are no fractions of 1";
    EXPECT_EQ(colours_of("uint", "65535 0 0"), (Colour{255, 0, 0}));
    EXPECT_EQ(colours_of("uchar", "1 0 300"), (Colour{1, 0, 255}));
    EXPECT_EQ(colours_of("char", "-1 -128 5"), (Colour{255, 128, 5})) << "bytes that a program has with a sign";
    EXPECT_EQ(colours_of("float", "0 0.5 1", {.limits = {}, .colour_range = ColourRange::bytes}), (Colour{0, 1, 1}));
    EXPECT_EQ(colours_of("ushort", "0 1 255", {.limits = {}, .colour_range = ColourRange::words}), (Colour{0, 0, 1}));
    EXPECT_EQ(colours_of("int", "0 1 255", {.limits = {}, .colour_range = ColourRange::unit}), (Colour{0, 1, 255}));
}

TEST(PlyKinds, ColoursInBlocksAreAsThoseReadValueByValue) {
    const std::string colours = "property float red\nproperty uchar green\nproperty char blue\n";
    const std::string body = std::string(12, '\0') + little(0.5f) + "\x07\xff";
    MeshFindings findings;
    const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz + colours;
    const auto block = read(head + "end_header\n" + body, &findings);
    ASSERT_TRUE(block);
    EXPECT_EQ(block->colours, (std::vector<Colour>{{128, 7, 255}}));
    EXPECT_EQ(findings.colour_levels.up_to_unit, 1u);
    const auto single = read(head + "property list uchar uchar none\nend_header\n" + body + std::string(1, '\0'));
    ASSERT_TRUE(single);
    expect_equal(*single, *block);
}

TEST(PlyKinds, AttributesOfVerticesHaveManyNames) {
    for (const std::string names :
         {"red green blue", "Red Green Blue", "R G B", "r g b", "diffuse_red diffuse_green diffuse_blue"}) {
        std::istringstream words(names);
        std::string properties = "property uchar alpha\n";
        for (std::string name; words >> name;) properties += "property uchar " + name + "\n";
        const auto mesh = read(points(1, properties, "0 0 0 9 1 2 3\n"));
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->colours, (std::vector<Colour>{{1, 2, 3}})) << names;
    }
    for (const std::string name : {"color", "rgba", "Colors"}) {
        const auto mesh = read(points(1, "property list uchar uchar " + name + "\n", "0 0 0 4 1 2 3 9\n"));
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->colours, (std::vector<Colour>{{1, 2, 3}})) << name;
    }
    for (const std::string names :
         {"s t", "u v", "S T", "texture_u texture_v", "texcoord_u texcoord_v", "s0 t0", "u0 v0"}) {
        const auto blank = names.find(' ');
        const auto mesh = read(
            points(1, "property float " + names.substr(0, blank) + "\nproperty float " + names.substr(blank + 1) + "\n",
                   "0 0 0 0.25 0.5\n"));
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->texcoords, (std::vector<Vector2f>{{0.25f, 0.5f}})) << names;
    }
    const auto mixed = read(points(1, "property float s\nproperty float u\nproperty float v\n", "0 0 0 9 0.25 0.5\n"));
    ASSERT_TRUE(mixed);
    EXPECT_EQ(mixed->texcoords, (std::vector<Vector2f>{{0.25f, 0.5f}})) << "of names that belong together";
}

TEST(PlyKinds, ColoursThatAreNotReadAreTold) {
    const auto remark_on = [](const std::string& properties, const std::string& values) {
        MeshFindings findings;
        const auto mesh = read(points(1, properties, "0 0 0 " + values + "\n"), &findings);
        EXPECT_TRUE(mesh && mesh->colours.empty());
        return findings.remarks.size() == 1 ? findings.remarks[0].about : std::string();
    };
    EXPECT_EQ(remark_on("property float intensity\n", "1"), "grey");
    EXPECT_EQ(remark_on("property uchar Gray\n", "1"), "grey");
    EXPECT_EQ(remark_on("property uint rgba\n", "1"), "packed-colours");
    EXPECT_EQ(remark_on("property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n", "1 1 1"), "splats");
    EXPECT_EQ(remark_on("property float quality\n", "1"), "");
    MeshFindings findings;
    ASSERT_TRUE(
        read(points(1, "property uchar intensity\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
                    "0 0 0 1 2 3 4\n"),
             &findings));
    EXPECT_TRUE(findings.remarks.empty());
}

TEST(PlyKinds, ColoursOfFacesBecomeThoseOfVerticesByArea) {
    const std::string colours = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    MeshFindings findings;
    const auto mesh = read(square(2, colours, "3 0 1 2 200 0 10 255\n3 0 2 3 100 50 0 255\n"), &findings);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->colours, (std::vector<Colour>{{150, 25, 5}, {200, 0, 10}, {150, 25, 5}, {100, 50, 0}}));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "face-colours");
    // A quad of the whole square beside a triangle of its half; its first triangle counts like any.
    const auto quad = read(square(2, colours, "4 0 1 2 3 90 0 0 255\n3 0 2 3 0 90 0 255\n"));
    ASSERT_TRUE(quad);
    EXPECT_EQ(quad->colours[0], (Colour{60, 30, 0}));
    EXPECT_EQ(quad->colours[1], (Colour{90, 0, 0}));
    EXPECT_EQ(quad->colours[3], (Colour{45, 45, 0}));
    const auto fractions =
        replaced(square(2, colours, "3 0 1 2 1 0 0.5 1\n3 0 1 2 1 0 0.5 1\n"), "uchar red", "float red");
    const auto floats =
        read(replaced(replaced(fractions, "uchar green", "float green"), "uchar blue", "float blue"), &findings);
    ASSERT_TRUE(floats) << floats.error().message;
    EXPECT_EQ(floats->colours, (std::vector<Colour>{{255, 0, 128}, {255, 0, 128}, {255, 0, 128}, {255, 255, 255}}))
        << "a vertex without a face is white";
    EXPECT_TRUE(findings.colour_levels.any());
}

TEST(PlyKinds, ColoursOfCornersBecomeThoseOfVertices) {
    const std::string list = "property list uchar float color\n";
    const auto each = read(square(2, list, "3 0 1 2 9 1 0 0 0 1 0 0 0 1\n3 0 2 3 9 1 0 0 0 0 1 1 1 1\n"));
    ASSERT_TRUE(each) << each.error().message;
    EXPECT_EQ(each->colours, (std::vector<Colour>{{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 255, 255}}));
    const auto with_alpha = read(square(1, list, "3 0 1 2 12 1 0 0 1 0 1 0 1 0 0 1 1\n"));
    ASSERT_TRUE(with_alpha);
    EXPECT_EQ(with_alpha->colours[1], (Colour{0, 255, 0}));
    const auto one = read(square(1, list, "4 0 1 2 3 3 1 0 0\n"));
    ASSERT_TRUE(one);
    EXPECT_EQ(one->colours, std::vector<Colour>(4, Colour{255, 0, 0}));
}

TEST(PlyKinds, ColoursOfVerticesWinOverThoseOfFaces) {
    const std::string three = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    MeshFindings findings;
    const auto mesh = read("ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + three +
                               "element face 1\nproperty list uchar int vertex_indices\n" + three +
                               "end_header\n0 0 0 1 2 3\n3 0 0 0 9 9 9\n",
                           &findings);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->colours, (std::vector<Colour>{{1, 2, 3}}));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "face-colours");
}

TEST(PlyKinds, TexcoordsOfCornersSplitVertices) {
    const std::string list = "property list uchar float texcoord\n";
    const auto mesh = read(square(3, list, "3 0 1 2 6 0 0 1 0 1 1\n4 0 1 2 3 8 0 0 1 0 0.5 1 0 1\n3 1 2 3 0\n"));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 4}, {0, 4, 3}, {5, 6, 7}}));
    EXPECT_EQ(mesh->positions[4], mesh->positions[2]);
    EXPECT_EQ(mesh->texcoords,
              (std::vector<Vector2f>{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5f, 1}, {0, 0}, {0, 0}, {0, 0}}));
    const auto none = read(square(1, list, "3 0 1 2 0\n"));
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->texcoords.empty());
    const auto late = read(square(2, list, "3 0 1 2 0\n3 0 1 2 6 0 0 1 0 1 1\n"));
    ASSERT_TRUE(late);
    EXPECT_EQ(late->positions.size(), 6u);
    const auto limited = read_ply(bytes_of(square(2, list, "3 0 1 2 6 0 0 1 0 1 1\n3 0 1 2 6 1 1 1 1 0 0\n")),
                                  {.limits = {.most_vertices = 5}});
    ASSERT_FALSE(limited);
    EXPECT_EQ(limited.error().kind, ErrorKind::limit);
}

TEST(PlyKinds, FacesSayWhichImageIsTheirs) {
    const std::string two = "comment TextureFile a b.png \nobj_info TextureFile \"c.png\"\n";
    const std::string number = "property int texnumber\n";
    MeshFindings findings;
    ASSERT_TRUE(read(square(4, number, "3 0 1 2 1\n4 0 1 2 3 0\n3 0 1 2 -1\n3 0 1 2 77\n", two), &findings));
    const auto& texture = findings.texture;
    ASSERT_EQ(texture.images.size(), 2u);
    EXPECT_EQ(texture.images[0].name, "a b.png");
    EXPECT_EQ(texture.images[1].name, "c.png");
    ASSERT_EQ(texture.parts.size(), 3u);
    EXPECT_EQ(texture.parts[1].image, 1u);
    EXPECT_FALSE(texture.parts[2].image);
    EXPECT_EQ(texture.part_of_triangle, (std::vector<std::uint16_t>{1, 0, 0, 2, 2}));
    ASSERT_TRUE(read(square(1, number, "3 0 1 2 0\n", "comment texturefile a.png\n"), &findings));
    EXPECT_EQ(findings.texture.parts.size(), 1u);
    EXPECT_TRUE(findings.texture.part_of_triangle.empty());
    EXPECT_TRUE(findings.remarks.empty());
    ASSERT_TRUE(read(square(2, number, "3 0 1 2 0\n3 0 1 2 -1\n", "comment TextureFile a.png\n"), &findings));
    EXPECT_EQ(findings.texture.part_of_triangle, (std::vector<std::uint16_t>{0, 1}));
    ASSERT_TRUE(read(square(1, "", "3 0 1 2\n", two), &findings));
    EXPECT_EQ(findings.texture.parts.size(), 2u);
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_TRUE(findings.remarks[0].is_loss);
}

TEST(PlyKinds, TriangleStripsAreRead) {
    const auto strips = [](const std::string& type, const std::string& lines) {
        return "ply\nformat ascii 1.0\nelement vertex 4\n" + xyz + "element tristrips 1\nproperty list int " + type +
               " vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n" + lines;
    };
    const std::vector<Triangle> expected = {{0, 1, 2}, {2, 1, 3}, {3, 2, 1}};
    for (const auto& [type, end] :
         std::vector<std::pair<std::string, std::string>>{{"int", "-1"}, {"uint", "4294967295"}, {"ushort", "65535"}}) {
        const auto mesh = read(strips(type, "10 0 1 2 3 " + end + " 3 2 1 " + end + " 0\n"));
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->triangles, expected) << type;
    }
    const auto joined = read(strips("int", "7 0 1 2 2 2 1 3\n"));
    ASSERT_TRUE(joined);
    EXPECT_EQ(joined->triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}}));
    EXPECT_FALSE(read(strips("int", "3 0 1 4\n")));
    EXPECT_FALSE(read(strips("int", "3 0 1\n")));
    EXPECT_FALSE(read_ply(bytes_of(strips("int", "4 0 1 2 3\n")), {.limits = {.most_triangles = 1}}));
}

TEST(PlyKinds, PositionsThatAreNotFiniteAreLeftOutWhereTheyAreFew) {
    std::string lines, faces;
    for (int v = 0; v < 20; ++v) lines += std::to_string(v) + " 0 " + std::to_string(v % 2) + "\n";
    for (int f = 0; f < 18; ++f)
        faces += "3 " + std::to_string(f) + " " + std::to_string(f + 1) + " " + std::to_string(f + 2) + " 1\n";
    const auto with = [&](const std::string& more, std::size_t count) {
        return "ply\nformat ascii 1.0\ncomment TextureFile a\ncomment TextureFile b\nelement vertex " +
               std::to_string(20 + count) + "\n" + xyz +
               "element face 18\nproperty list uchar int vertex_indices\nproperty int texnumber\nend_header\n" + lines +
               more + faces;
    };
    MeshFindings findings;
    const auto unused = read(with("1.#QNAN 0 0\n-1.#IND 0 0\n0 1.#INF00 0\nnan(ind) -inf 1e99\n", 4), &findings);
    ASSERT_TRUE(unused) << unused.error().message;
    EXPECT_EQ(unused->positions.size(), 20u);
    EXPECT_EQ(unused->triangles.size(), 18u);
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_EQ(findings.remarks[0].about, "not-finite");
    EXPECT_THAT(findings.remarks[0].text, HasSubstr("4 vertices"));
    const auto used = read(replaced(with("", 0), "19 0 1\n", "nan 0 1\n"), &findings);
    ASSERT_TRUE(used) << used.error().message;
    EXPECT_EQ(used->triangles.size(), 17u);
    EXPECT_EQ(findings.texture.part_of_triangle, std::vector<std::uint16_t>(17, 1));
    ASSERT_EQ(findings.remarks.size(), 1u);
    EXPECT_TRUE(findings.remarks[0].is_loss);
    EXPECT_FALSE(read(points(1, "", "nan 0 0\n"))) << "nothing is left";
    const auto cloud = read(points(3, "", "nan 0 0\n1 2 3\n0 nan 0\n"));
    ASSERT_TRUE(cloud);
    EXPECT_EQ(cloud->positions, (std::vector<Vector3f>{{1, 2, 3}}));
}

TEST(PlyKinds, TheOriginIsTakenOffBeforePositionsBecomeFloats) {
    const MeshReadOptions options{.limits = {}, .origin = {4075539.5, -1, 0}};
    const std::string head =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty double x\nproperty float y\nproperty float "
        "z\n";
    const std::string body = little(4075539.501) + little(0.25f) + little(0.1f);
    for (const auto& bytes : {head + "end_header\n" + body,
                              head + "property list uchar uchar none\nend_header\n" + body + std::string(1, '\0'),
                              points(1, "", "4075539.501 0.25 0.1\n")}) {
        const auto mesh = read(bytes, nullptr, options);
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->positions[0], (Vector3f{static_cast<float>(4075539.501 - 4075539.5), 1.25f, 0.1f}));
    }
    const auto far = read(points(1, "", "1e39 0 0\n"), nullptr, {.limits = {}, .origin = {1e39, 0, 0}});
    ASSERT_TRUE(far) << "what remains fits";
    EXPECT_EQ(far->positions[0], (Vector3f{0, 0, 0}));
}

TEST(PlyKinds, ConcaveFacesAreCutWithinThemselvesThoughVerticesComeLater) {
    const auto mesh =
        read("ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 4\n" + xyz +
             "end_header\n4 0 1 2 3\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    for (const auto& triangle : mesh->triangles)
        EXPECT_TRUE(std::ranges::count(triangle, 1u) == 1 && std::ranges::count(triangle, 3u) == 1);
}

}  // namespace
}  // namespace htvm
