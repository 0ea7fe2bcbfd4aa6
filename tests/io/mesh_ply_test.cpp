#include <bit>
#include <limits>
#include <random>
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

Result<Mesh> read(const std::string& text) { return read_ply(bytes_of(text)); }

// The bytes of a value, most significant first.
template <class T, class Bits>
std::string big_endian(T value) {
    const auto bits = std::bit_cast<Bits>(value);
    std::string out;
    for (std::size_t i = sizeof bits; i-- > 0;) out += static_cast<char>((bits >> (8 * i)) & 255);
    return out;
}
std::string be32(float v) { return big_endian<float, std::uint32_t>(v); }
std::string be64(double v) { return big_endian<double, std::uint64_t>(v); }
std::string be16(std::int16_t v) { return big_endian<std::int16_t, std::uint16_t>(v); }
std::string be32i(std::int32_t v) { return big_endian<std::int32_t, std::uint32_t>(v); }

const std::string four_points =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string four_lines = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(PlyReading, AsciiPositionsAndTriangles) {
    const auto mesh = read(four_points + "element face 2\nproperty list uchar int vertex_indices\nend_header\n" +
                           four_lines + "3 0 1 2\n3 0 2 3\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_TRUE(mesh->colours.empty() && mesh->normals.empty() && mesh->texcoords.empty());
}

TEST(PlyReading, PolygonsBecomeFansThatKeepTheirOrientationAndSmallFacesAreLeftOut) {
    const auto mesh = read(four_points + "element face 5\nproperty list uint8 uint32 vertex_index\nend_header\n" +
                           four_lines + "4 1 2 3 0\n2 0 1\n0\n1 3\n3 3 3 1\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}, {3, 3, 1}}));
}

TEST(PlyReading, ExtraElementsPropertiesAndListsAreSkippedInText) {
    const auto mesh = read(
        "ply\r\nformat ascii 1.0\r\ncomment of x\r\nobj_info y\r\nelement camera 1\r\nproperty float a\r\n"
        "property list int float b\r\nelement vertex 1\r\nproperty double quality\r\nproperty float x\r\n"
        "property list uchar short ring\r\nproperty short y\r\nproperty int8 z\r\nelement empty 4000000000\r\n"
        "element face 1\r\nproperty uchar flags\r\nproperty list uchar uint vertex_indices\r\n"
        "property list uchar float more\r\nend_header\r\n"
        "1.5 2 7 8\r\n0.25 +10e-1 3 7 7 7 -2 3\r\n1 3 0 0 0 6 .1 .2 .3 .4 .5 .6\r\n");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{1, -2, 3}}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 0, 0}}));
}

TEST(PlyReading, BigEndianWithEveryPlaceForSurprises) {
    const std::string header =
        "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty list uchar double extra\nproperty float64 x\n"
        "property int16 y\nproperty float z\nproperty float red\nproperty float green\nproperty float blue\n"
        "property uchar alpha\nelement face 1\nproperty list ushort int vertex_indices\nend_header\n";
    const std::string body = std::string(1, 2) + be64(9) + be64(8) + be64(0.5) + be16(-3) + be32(2) + be32(0) +
                             be32(0.5f) + be32(1) + "\xff" + std::string(1, 0) + be64(-1) + be16(300) + be32(4) +
                             be32(1) + be32(1.25f) + be32(-7) + "\x01" + be16(3) + be32i(1) + be32i(0) + be32i(1);
    const auto mesh = read(header + body);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0.5f, -3, 2}, {-1, 300, 4}}));
    EXPECT_EQ(mesh->colours, (std::vector<Colour>{{0, 128, 255}, {255, 255, 0}}));
    EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{1, 0, 1}}));
}

// A value of a binary file: any bits of a whole number; of a number with a fraction at times none that is finite.
std::string random_value(const std::string& type, bool is_big_endian, std::mt19937& random) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const double value = random() % 4000 > 0 ? 0.25 * static_cast<double>(random() % 9) - 1
                         : random() % 2      ? nan
                                             : 1e300;
    std::string out = type == "float"    ? be32(static_cast<float>(value))
                      : type == "double" ? be64(value)
                                         : std::string();
    const std::size_t size = type == "char" || type == "uchar" ? 1 : type == "short" || type == "ushort" ? 2 : 4;
    while (out.empty() || (type != "float" && type != "double" && out.size() < size))
        out += static_cast<char>(random() & 255);
    return is_big_endian ? out : std::string(out.rbegin(), out.rend());
}

// A list, though it is empty, has vertices read value by value.
TEST(PlyReading, VerticesInBlocksAreAsThoseReadValueByValue) {
    const std::vector<std::string> types = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
    std::mt19937 random(6);
    std::size_t read_well = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const bool is_big_endian = random() % 2 > 0;
        const std::size_t vertices = trial % 20 == 0 ? 4000 : 1 + random() % 9;
        std::string properties;
        std::vector<std::string> type_of;
        for (const char* name : {"x", "y", "other", "z", "nx", "ny", "nz", "s", "more", "t", "red", "green", "blue"}) {
            type_of.push_back(types[random() % types.size()]);
            properties += "property " + type_of.back() + " " + name + "\n";
        }
        const auto header = [&](const std::string& list) {
            return std::string("ply\nformat binary_") + (is_big_endian ? "big" : "little") +
                   "_endian 1.0\nelement vertex " + std::to_string(vertices) + "\n" + properties + list +
                   "end_header\n";
        };
        std::string block = header(""), one_by_one = header("property list uchar uchar none\n");
        const std::size_t written = random() % 10 > 0 ? vertices : random() % vertices;
        for (std::size_t v = 0; v < written; ++v) {
            std::string vertex;
            for (const auto& type : type_of) vertex += random_value(type, is_big_endian, random);
            block += vertex;
            one_by_one += vertex + std::string(1, 0);
        }
        std::istringstream stream(block), other_stream(one_by_one);
        const auto found = PlyStreamReader(stream).next(), expected = PlyStreamReader(other_stream).next();
        ASSERT_EQ(found.has_value(), expected.has_value()) << trial;
        const auto in_memory = read(block);
        EXPECT_EQ(in_memory.has_value(), found.has_value()) << trial;
        if (!found) {
            EXPECT_EQ(found.error().message, expected.error().message) << trial;
            continue;
        }
        ++read_well;
        expect_equal(**found, **expected);
        expect_equal(*in_memory, **expected);
    }
    EXPECT_GT(read_well, 200u);
}

TEST(PlyReading, TrianglesAmongOtherFacesKeepTheirOrder) {
    Mesh points = random_mesh(8, 9, 0, {});
    for (auto& position : points.positions) position[1] = position[2] = 0;  // no polygon has an area: fans stay
    const auto whole = write_ply(points);
    ASSERT_TRUE(whole);
    std::string header = text_of(*whole);
    const auto count = header.find("element face 0");
    ASSERT_NE(count, header.npos);
    std::mt19937 random(9);
    for (const unsigned others : {0u, 3u, 300u}) {  // one of so many
        constexpr std::uint32_t faces = 2000;
        std::string bytes = header;
        bytes.replace(count, 14, "element face " + std::to_string(faces));
        std::vector<Triangle> expected;
        for (std::uint32_t f = 0; f < faces; ++f) {
            std::vector<std::uint32_t> corners(others > 0 && random() % others == 0 ? random() % 6 : 3);
            bytes += static_cast<char>(corners.size());
            for (auto& corner : corners) {
                corner = static_cast<std::uint32_t>(random() % 9);
                const auto big = be32i(static_cast<std::int32_t>(corner));
                bytes.append(big.rbegin(), big.rend());
            }
            for (std::size_t c = 2; c < corners.size(); ++c)
                expected.push_back({corners[0], corners[c - 1], corners[c]});
        }
        const auto mesh = read(bytes);
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->triangles, expected);
        std::istringstream stream(bytes);
        const auto next = PlyStreamReader(stream).next();
        ASSERT_TRUE(next) << next.error().message;
        EXPECT_EQ((*next)->triangles, expected);
        const MeshReadOptions limits{.limits = {.most_triangles = expected.size() - 1}};
        EXPECT_FALSE(read_ply(bytes_of(bytes), limits));
        const auto damaged = read(bytes.substr(0, bytes.size() - 1) + "\x01");  // the last corner's highest byte
        EXPECT_FALSE(damaged);
    }
}

TEST(PlyReading, AttributesGoByAnyOfTheirNames) {
    for (const std::string prefix : {"", "diffuse_"}) {
        for (const auto& [first, second] :
             std::vector<std::pair<std::string, std::string>>{{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}) {
            const auto mesh = read(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                "property float nx\nproperty float ny\nproperty float nz\nproperty float " +
                first + "\nproperty float " + second + "\nproperty uchar " + prefix + "red\nproperty uchar " + prefix +
                "green\nproperty uchar " + prefix + "blue\nend_header\n1 2 3 0 nan 1 .25 inf 10 20 300\n");
            ASSERT_TRUE(mesh) << mesh.error().message;
            EXPECT_EQ(mesh->normals, (std::vector<Vector3f>{{0, 0, 1}}));
            EXPECT_EQ(mesh->texcoords, (std::vector<Vector2f>{{0.25f, 0}}));
            EXPECT_EQ(mesh->colours, (std::vector<Colour>{{10, 20, 255}}));
        }
    }
}

TEST(PlyReading, ErrorsNameTheVertexOrTheFace) {
    const std::string faces = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    for (const std::string bad : {"nan", "inf", "-inf", "1e39", "1e999"}) {
        const auto mesh = read(four_points + faces + "0 0 0\n1 0 0\n1 " + bad + " 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
        ASSERT_FALSE(mesh) << bad;
        EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
        EXPECT_THAT(mesh.error().message, HasSubstr("vertex 2 ")) << bad;
    }
    for (const std::string bad : {"4", "-1", "1.5", "4294967296", "nan"}) {
        const auto mesh = read(four_points + faces + four_lines + "3 0 1 2\n3 0 2 " + bad + "\n");
        ASSERT_FALSE(mesh) << bad;
        EXPECT_THAT(mesh.error().message, HasSubstr("face 1 ")) << bad;
    }
    const auto word = read(four_points + "end_header\n0 0 0\n1 zero 0\n1 1 0\n0 1 0\n");
    ASSERT_FALSE(word);
    EXPECT_THAT(word.error().message, HasSubstr("vertex 1 of 4"));
}

TEST(PlyReading, HeadersThatLieAboutCountsAreRefusedBeforeAllocation) {
    const MeshReadOptions no_limits{{~std::uint64_t{0}, ~std::uint64_t{0}}};
    for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        for (const std::string count : {"2147483648", "4294967295", "18446744073709551615"}) {
            const std::string vertices =
                "ply\nformat " + format + " 1.0\nelement vertex " + count +
                "\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3 4 5 6 ";
            EXPECT_FALSE(read_ply(bytes_of(vertices)));
            EXPECT_FALSE(read_ply(bytes_of(vertices), no_limits));
            std::istringstream stream(vertices);
            EXPECT_FALSE(PlyStreamReader(stream, no_limits).next());
            const std::string faces = "ply\nformat " + format +
                                      " 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
                                      "element face " +
                                      count + "\nproperty list uchar int vertex_indices\nend_header\n0 0 0 ";
            EXPECT_FALSE(read_ply(bytes_of(faces), no_limits));
            std::istringstream face_stream(faces);
            EXPECT_FALSE(PlyStreamReader(face_stream, no_limits).next());
        }
    }
    const auto list = read(
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
        "property list uint double extra\nend_header\nabc\xff\xff\xff\xff");
    EXPECT_FALSE(list);
    const auto negative = read(
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
        "property list int uchar extra\nend_header\nabc\xff\xff\xff\xff");
    EXPECT_FALSE(negative);
}

TEST(PlyReading, LimitsAreErrorsOfTheirOwnKind) {
    const auto bytes = write_ply(random_mesh(1, 10, 20));
    ASSERT_TRUE(bytes);
    EXPECT_TRUE(read_ply(*bytes, {{10, 20}}));
    for (const MeshReadOptions limits : {MeshReadOptions{{9, 20}}, MeshReadOptions{{10, 19}}}) {
        const auto mesh = read_ply(*bytes, limits);
        ASSERT_FALSE(mesh);
        EXPECT_EQ(mesh.error().kind, ErrorKind::limit);
    }
}

TEST(PlyReading, BrokenHeadersAreErrors) {
    for (const std::string bad : {
             "",
             "p",
             "ply",
             "ply\n",
             "plx\nformat ascii 1.0\nelement vertex 0\nend_header\n",
             "ply\nelement vertex 0\nend_header\n",
             "ply\nformat ascii 1.0\nend_header\n",
             "ply\nformat ascii 2.0\nelement vertex 0\nend_header\n",
             "ply\nformat text 1.0\nelement vertex 0\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 99999999999999999999\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nelement vertex 0\nend_header\n",
             "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nproperty quad x\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nproperty list float int x\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float x\nend_header\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nelement face 1\nproperty uchar a\nend_header\n1\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nelement tristrips 1\nproperty int a\nend_header\n1\n",
             "ply\nformat ascii 1.0\nelement vertex 0\nnonsense\nend_header\n",
         }) {
        EXPECT_FALSE(read(bad)) << bad;
    }
    std::string many = "ply\nformat ascii 1.0\n";
    for (int i = 0; i < 100000; ++i) many += "element a" + std::to_string(i) + " 0\n";
    EXPECT_FALSE(read(many + "element vertex 0\nend_header\n"));
    EXPECT_FALSE(
        read("ply\nformat ascii 1.0\ncomment " + std::string(2 << 20, 'x') + "\nelement vertex 0\nend_header\n"));
}

TEST(PlyReading, EveryTruncationIsAnError) {
    const auto whole = write_ply(random_mesh(3, 7, 5));
    ASSERT_TRUE(whole);
    for (std::size_t n = 0; n < whole->size(); ++n) {
        const std::vector<std::uint8_t> cut(whole->begin(), whole->begin() + static_cast<std::ptrdiff_t>(n));
        EXPECT_FALSE(read_ply(cut)) << n;
        std::istringstream stream(text_of(cut));
        const auto next = PlyStreamReader(stream).next();
        EXPECT_EQ(next.has_value(), n == 0) << n;
    }
    const std::string text = four_points + "element face 2\nproperty list uchar int vertex_indices\nend_header\n" +
                             four_lines + "3 0 1 2\n3 0 2 3\n";
    for (std::size_t n = 0; n < text.size(); ++n) {
        const bool only_the_line_end_lacks = n == text.size() - 1;
        EXPECT_EQ(read(text.substr(0, n)).has_value(), only_the_line_end_lacks) << n;
        std::istringstream stream(text.substr(0, n));
        EXPECT_EQ(PlyStreamReader(stream).next().has_value(), only_the_line_end_lacks || n == 0) << n;
    }
}

TEST(PlyReading, DamagedBytesGiveAMeshOrAnError) {
    const auto whole = write_ply(random_mesh(4, 12, 15));
    ASSERT_TRUE(whole);
    std::mt19937 random(5);
    for (int trial = 0; trial < 20000; ++trial) {
        auto damaged = *whole;
        for (int hit = 0; hit < 3; ++hit)
            damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random() & 255);
        if (const auto mesh = read_ply(damaged)) {
            EXPECT_TRUE(check_mesh(*mesh));
        }
    }
}

TEST(PlyWriting, ReadsBackExactlyWithAnySetOfAttributes) {
    for (unsigned seed = 0; seed < 8; ++seed) {
        for (const std::size_t vertices : {0, 1, 2, 100}) {
            const Mesh mesh =
                random_mesh(seed, vertices, vertices * 2, {(seed & 1) != 0, (seed & 2) != 0, (seed & 4) != 0});
            const auto bytes = write_ply(mesh);
            ASSERT_TRUE(bytes);
            const auto again = read_ply(*bytes);
            ASSERT_TRUE(again) << again.error().message;
            expect_equal(*again, mesh);
        }
    }
}

TEST(PlyWriting, TheBytesOfASmallMeshAreThese) {
    Mesh mesh;
    mesh.positions = {{1, 0, -2}};
    mesh.colours = {{1, 2, 3}};
    mesh.triangles = {{0, 0, 0}};
    const auto bytes = write_ply(mesh);
    ASSERT_TRUE(bytes);
    EXPECT_EQ(text_of(*bytes),
              std::string("ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                          "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                          "element face 1\nproperty list uchar uint vertex_indices\nend_header\n") +
                  std::string("\0\0\x80\x3f\0\0\0\0\0\0\0\xc0\x01\x02\x03", 15) +
                  std::string("\x03\0\0\0\0\0\0\0\0\0\0\0\0", 13));
}

TEST(PlyWriting, RefusesMeshesThatContradictThemselves) {
    Mesh mesh = random_mesh(1, 3, 1);
    mesh.triangles[0][1] = 3;
    EXPECT_FALSE(write_ply(mesh));
    mesh = random_mesh(1, 3, 1);
    mesh.colours.pop_back();
    EXPECT_FALSE(write_ply(mesh));
    mesh = random_mesh(1, 3, 1);
    mesh.positions[2][0] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(write_ply(mesh));
}

std::vector<std::string> concatenated_samples() {
    std::vector<std::string> plys;
    for (unsigned seed = 0; seed < 4; ++seed) {
        plys.push_back(text_of(*write_ply(random_mesh(seed, seed * 5000, seed * 9000, {true, seed % 2 == 0, false}))));
        plys.push_back(four_points + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                       four_lines + "3 0 1 2\n");
        plys.push_back("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n");
    }
    return plys;
}

TEST(PlyStream, PlysOneAfterAnotherComeOutOneByOneFromMemory) {
    const auto plys = concatenated_samples();
    std::string all;
    for (const std::string& ply : plys) all += ply;
    auto rest = bytes_of(all);
    for (const std::string& ply : plys) {
        const auto read_here = read_ply_at_start(rest);
        ASSERT_TRUE(read_here) << read_here.error().message;
        EXPECT_EQ(read_here->bytes_consumed, ply.size());
        expect_equal(read_here->mesh, *read(ply));
        rest = rest.subspan(read_here->bytes_consumed);
    }
    EXPECT_TRUE(rest.empty());
    EXPECT_FALSE(read(all)) << "a file with several meshes is not one mesh";
}

TEST(PlyStream, PlysOneAfterAnotherComeOutOneByOneFromAStreamThatIsNotReadAhead) {
    const auto plys = concatenated_samples();
    std::string all;
    for (const std::string& ply : plys) all += ply;
    std::istringstream stream(all + "\n");
    PlyStreamReader reader(stream);
    std::size_t end = 0;
    for (const std::string& ply : plys) {
        const auto mesh = reader.next();
        ASSERT_TRUE(mesh) << mesh.error().message;
        ASSERT_TRUE(*mesh);
        expect_equal(**mesh, *read(ply));
        end += ply.size();
        EXPECT_EQ(static_cast<std::size_t>(stream.tellg()), end);
    }
    const auto last = reader.next();
    ASSERT_TRUE(last);
    EXPECT_FALSE(*last);
}

TEST(PlyStream, AnErrorNamesTheMeshAndStays) {
    std::istringstream stream(four_points + "end_header\n" + four_lines + "plop");
    PlyStreamReader reader(stream);
    ASSERT_TRUE(reader.next());
    for (int i = 0; i < 2; ++i) {
        const auto mesh = reader.next();
        ASSERT_FALSE(mesh);
        EXPECT_THAT(mesh.error().message, HasSubstr("mesh 1 "));
    }
}

TEST(PlyStream, AnEmptyStreamHoldsNoMesh) {
    std::istringstream stream("");
    const auto mesh = PlyStreamReader(stream).next();
    ASSERT_TRUE(mesh);
    EXPECT_FALSE(*mesh);
}

}  // namespace
}  // namespace htvm
