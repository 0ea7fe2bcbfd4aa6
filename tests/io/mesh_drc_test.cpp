#include <draco/compression/encode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <draco/point_cloud/point_cloud_builder.h>

#include <algorithm>
#include <cmath>

#include "gmock/gmock.h"
#include "io/drc.h"
#include "io/mesh_samples.h"

namespace htvm {
namespace {

using draco::GeometryAttribute;

// A grid of n by n squares, with colours (of `components`), normals and texture coordinates.
std::vector<std::uint8_t> encoded_grid(int n, int encoding_method, int speed, std::uint8_t components = 3) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(2 * n * n);
    const int position = builder.AddAttribute(GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int colour =
        builder.AddAttribute(GeometryAttribute::COLOR, static_cast<std::int8_t>(components), draco::DT_UINT8);
    const int normal = builder.AddAttribute(GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
    const int texcoord = builder.AddAttribute(GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    const auto set = [&](int face, std::array<std::array<int, 2>, 3> corners) {
        std::array<std::array<float, 3>, 3> p, m;
        std::array<std::array<float, 2>, 3> t;
        std::array<std::array<std::uint8_t, 4>, 3> c;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto x = static_cast<float>(corners[i][0]);
            const auto y = static_cast<float>(corners[i][1]);
            p[i] = {x, y, 0};
            m[i] = {0, 0, 1};
            t[i] = {x / 64, y / 64};
            c[i] = {static_cast<std::uint8_t>(corners[i][0]), static_cast<std::uint8_t>(corners[i][1]), 7, 99};
        }
        const draco::FaceIndex f(static_cast<std::uint32_t>(face));
        builder.SetAttributeValuesForFace(position, f, &p[0], &p[1], &p[2]);
        builder.SetAttributeValuesForFace(colour, f, &c[0], &c[1], &c[2]);
        builder.SetAttributeValuesForFace(normal, f, &m[0], &m[1], &m[2]);
        builder.SetAttributeValuesForFace(texcoord, f, &t[0], &t[1], &t[2]);
    };
    int face = 0;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            set(face++, {{{x, y}, {x + 1, y}, {x + 1, y + 1}}});
            set(face++, {{{x, y}, {x + 1, y + 1}, {x, y + 1}}});
        }
    }
    const auto mesh = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetEncodingMethod(encoding_method);
    encoder.SetSpeedOptions(speed, speed);
    encoder.SetAttributeQuantization(GeometryAttribute::TEX_COORD, 12);
    encoder.SetAttributeQuantization(GeometryAttribute::NORMAL, 8);
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    return {buffer.data(), buffer.data() + buffer.size()};
}

TEST(DrcReading, EveryAttributeFollowsItsPointThroughBothMeshCoders) {
    for (const int method :
         {static_cast<int>(draco::MESH_SEQUENTIAL_ENCODING), static_cast<int>(draco::MESH_EDGEBREAKER_ENCODING)}) {
        for (const std::uint8_t components : {std::uint8_t{3}, std::uint8_t{4}}) {
            const auto mesh = read_drc(encoded_grid(6, method, 0, components));
            ASSERT_TRUE(mesh) << mesh.error().message;
            ASSERT_EQ(mesh->positions.size(), 49u);
            ASSERT_EQ(mesh->triangles.size(), 72u);
            ASSERT_TRUE(check_mesh(*mesh));
            for (std::size_t v = 0; v < 49; ++v) {
                const Vector3f& p = mesh->positions[v];
                EXPECT_EQ(mesh->colours[v],
                          (Colour{static_cast<std::uint8_t>(p[0]), static_cast<std::uint8_t>(p[1]), 7}));
                EXPECT_NEAR(mesh->texcoords[v][0], p[0] / 64, 1e-4);
                EXPECT_NEAR(mesh->texcoords[v][1], p[1] / 64, 1e-4);
                EXPECT_NEAR(mesh->normals[v][2], 1, 1e-4);
            }
            for (const Triangle& t : mesh->triangles) {  // counter-clockwise, as in the input
                const auto& [a, b, c] = t;
                const auto& p = mesh->positions;
                EXPECT_EQ((p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0]), 1);
            }
        }
    }
}

std::vector<std::uint8_t> encoded_points(std::uint32_t n, int method) {
    draco::PointCloudBuilder builder;
    builder.Start(n);
    const int position = builder.AddAttribute(GeometryAttribute::POSITION, 3, draco::DT_INT32);
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::array<std::int32_t, 3> p{static_cast<std::int32_t>(i), -100000, 5};
        builder.SetAttributeValueForPoint(position, draco::PointIndex(i), p.data());
    }
    const auto cloud = builder.Finalize(false);
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodePointCloudToBuffer(*cloud, &buffer).ok());
    return {buffer.data(), buffer.data() + buffer.size()};
}

TEST(DrcReading, PointCloudsWithIntegerPositionsAreTakenAsTheyAre) {
    const auto mesh = read_drc(encoded_points(5, draco::POINT_CLOUD_SEQUENTIAL_ENCODING));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(
        mesh->positions,
        (std::vector<Vector3f>{{0, -100000, 5}, {1, -100000, 5}, {2, -100000, 5}, {3, -100000, 5}, {4, -100000, 5}}));
    EXPECT_TRUE(mesh->triangles.empty());
}

TEST(DrcReading, PointCloudsOfTheTreeCoderComeInAnyOrder) {
    auto mesh = read_drc(encoded_points(5, draco::POINT_CLOUD_KD_TREE_ENCODING));
    ASSERT_TRUE(mesh) << mesh.error().message;
    std::sort(mesh->positions.begin(), mesh->positions.end());
    EXPECT_EQ(
        mesh->positions,
        (std::vector<Vector3f>{{0, -100000, 5}, {1, -100000, 5}, {2, -100000, 5}, {3, -100000, 5}, {4, -100000, 5}}));
}

TEST(DrcReading, WhatIsNoDracoFileIsAnError) {
    EXPECT_FALSE(read_drc({}));
    EXPECT_FALSE(read_drc(samples::bytes_of("DRACO")));
    EXPECT_FALSE(read_drc(samples::bytes_of("ply\nformat ascii 1.0\n")));
    auto old = encoded_points(5, draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    old[5] = 0;
    old[6] = 9;
    const auto mesh = read_drc(old);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().kind, ErrorKind::unsupported);
}

TEST(DrcReading, CountsThatTheFileCannotHoldAreRefusedBeforeAllocation) {
    auto points = encoded_points(5, draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    points[11] = points[12] = points[13] = 0xff;  // 24 bits of the count
    ASSERT_FALSE(read_drc(points));
    EXPECT_THAT(read_drc(points).error().message, testing::HasSubstr("16777215"));
    points[14] = 0x7f;
    ASSERT_FALSE(read_drc(points));
    EXPECT_EQ(read_drc(points).error().kind, ErrorKind::limit);
}

TEST(DrcReading, EveryTruncationIsAnError) {
    for (const auto& whole :
         {encoded_grid(4, draco::MESH_SEQUENTIAL_ENCODING, 5), encoded_grid(4, draco::MESH_EDGEBREAKER_ENCODING, 0),
          encoded_grid(4, draco::MESH_EDGEBREAKER_ENCODING, 7)}) {
        for (std::size_t n = 0; n < whole.size(); ++n) {
            const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
            EXPECT_FALSE(read_drc(cut)) << n << " of " << whole.size();
        }
    }
}

// ---- Layouts of attributes ------------------------------------------------------------------------------------------

// A point cloud, whose attributes tests choose.
struct Cloud {
    explicit Cloud(std::uint32_t n) : points(n) { builder.Start(n); }
    template <class T>
    void add(GeometryAttribute::Type kind, draco::DataType type, const std::vector<std::vector<T>>& rows,
             bool normalised = false) {
        const int attribute = builder.AddAttribute(kind, static_cast<std::int8_t>(rows[0].size()), type);
        if (normalised) normalised_ones.push_back(attribute);
        for (std::uint32_t p = 0; p < points; ++p)
            builder.SetAttributeValueForPoint(attribute, draco::PointIndex(p), rows[p].data());
    }
    std::vector<std::uint8_t> bytes() {
        const auto cloud = builder.Finalize(false);
        for (const int attribute : normalised_ones) cloud->attribute(attribute)->set_normalized(true);
        draco::Encoder encoder;
        encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
        draco::EncoderBuffer buffer;
        EXPECT_TRUE(encoder.EncodePointCloudToBuffer(*cloud, &buffer).ok());
        return {buffer.data(), buffer.data() + buffer.size()};
    }
    Mesh mesh(const MeshReadOptions& options = {}) {
        findings = {};
        const auto read = read_drc(bytes(), options, &findings);
        EXPECT_TRUE(read) << read.error().message;
        return read.value_or(Mesh());
    }
    std::uint32_t points;
    draco::PointCloudBuilder builder;
    std::vector<int> normalised_ones;
    MeshFindings findings;
};

template <class T>
std::vector<Colour> colours_of(draco::DataType type, const std::vector<std::vector<T>>& rows, bool normalised = false,
                               const MeshReadOptions& options = {}) {
    Cloud cloud(static_cast<std::uint32_t>(rows.size()));
    cloud.add<float>(GeometryAttribute::POSITION, draco::DT_FLOAT32,
                     std::vector<std::vector<float>>(rows.size(), {0, 0, 0}));
    cloud.add<T>(GeometryAttribute::COLOR, type, rows, normalised);
    return cloud.mesh(options).colours;
}

TEST(DrcReading, PositionsOfAnyTypeLoseTheOriginBeforeTheyBecomeFloats) {
    Cloud doubles(2), shorts(1);
    doubles.add<double>(GeometryAttribute::POSITION, draco::DT_FLOAT64, {{5400000.125, 1, 2}, {5400001, 1, 2}});
    MeshReadOptions options;
    options.origin = {5400000, 1, 0};
    EXPECT_EQ(doubles.mesh(options).positions, (std::vector<Vector3f>{{.125f, 0, 2}, {1, 0, 2}}));
    shorts.add<std::int16_t>(GeometryAttribute::POSITION, draco::DT_INT16, {{-300, 5, 7}});
    EXPECT_EQ(shorts.mesh().positions, (std::vector<Vector3f>{{-300, 5, 7}}));
}

TEST(DrcReading, ColoursOfFloatsAndShortsAreInTheRangeOfTheirBulk) {
    using Colours = std::vector<Colour>;
    EXPECT_EQ(colours_of<float>(draco::DT_FLOAT32, {{0, .5f, 1}}), (Colours{{0, 128, 255}}));
    EXPECT_EQ(colours_of<float>(draco::DT_FLOAT32, {{0, 128, 255}}), (Colours{{0, 128, 255}}));
    EXPECT_EQ(colours_of<std::uint16_t>(draco::DT_UINT16, {{0, 32896, 65535}}), (Colours{{0, 128, 255}}));
    EXPECT_EQ(colours_of<std::uint16_t>(draco::DT_UINT16, {{0, 128, 255}}), (Colours{{0, 128, 255}}));
    EXPECT_EQ(colours_of<std::uint16_t>(draco::DT_UINT16, {{0, 1, 1}}), (Colours{{0, 1, 1}})) << "dark, not white";
    EXPECT_EQ(colours_of<std::uint16_t>(draco::DT_UINT16, {{0, 257, 257}}, true), (Colours{{0, 1, 1}}));
    MeshReadOptions bytes;
    bytes.colour_range = ColourRange::bytes;
    EXPECT_EQ(colours_of<float>(draco::DT_FLOAT32, {{0, 1, 1}}, false, bytes), (Colours{{0, 1, 1}}))
        << "as the capture has it";
    EXPECT_EQ(colours_of<std::uint8_t>(draco::DT_UINT8, {{0, 1, 2}}), (Colours{{0, 1, 2}}));
    EXPECT_EQ(colours_of<std::uint8_t>(draco::DT_UINT8, {{0, 1, 2, 3}}, true), (Colours{{0, 1, 2}}));
    EXPECT_EQ(colours_of<std::uint8_t>(draco::DT_UINT8, {{9}}), (Colours{{9, 9, 9}})) << "grey";
    EXPECT_EQ(colours_of<std::uint8_t>(draco::DT_UINT8, {{9, 255}}), (Colours{{9, 9, 9}})) << "grey and alpha";
}

TEST(DrcReading, LevelsOfColoursAreToldForTheCapture) {
    Cloud cloud(1);
    cloud.add<float>(GeometryAttribute::POSITION, draco::DT_FLOAT32, {{0, 0, 0}});
    cloud.add<float>(GeometryAttribute::COLOR, draco::DT_FLOAT32, {{0, 1, 200}});
    (void)cloud.mesh();
    EXPECT_EQ(cloud.findings.colour_levels.up_to_unit, 1u);
    EXPECT_EQ(cloud.findings.colour_levels.up_to_bytes, 1u);
}

TEST(DrcReading, NormalsAndTextureCoordinatesMayBeIntegers) {
    for (const bool normalised : {false, true}) {
        Cloud cloud(1);
        cloud.add<float>(GeometryAttribute::POSITION, draco::DT_FLOAT32, {{0, 0, 0}});
        cloud.add<std::int8_t>(GeometryAttribute::NORMAL, draco::DT_INT8, {{127, 0, -127}}, normalised);
        cloud.add<std::uint16_t>(GeometryAttribute::TEX_COORD, draco::DT_UINT16, {{65535, 0}}, normalised);
        const auto mesh = cloud.mesh();
        EXPECT_EQ(mesh.normals, (std::vector<Vector3f>{{1, 0, -1}}));
        EXPECT_EQ(mesh.texcoords, (std::vector<Vector2f>{{1, 0}}));
    }
}

TEST(DrcReading, OfSeveralSetsTheFirstIsTakenAndOthersAreNotLookedAt) {
    Cloud cloud(1);
    cloud.add<float>(GeometryAttribute::POSITION, draco::DT_FLOAT32, {{0, 0, 0}});
    cloud.add<float>(GeometryAttribute::TEX_COORD, draco::DT_FLOAT32, {{.25f, .5f}});
    cloud.add<float>(GeometryAttribute::TEX_COORD, draco::DT_FLOAT32, {{0, 0}});
    cloud.add<std::uint8_t>(GeometryAttribute::GENERIC, draco::DT_UINT8, {{1, 2, 3, 4, 5, 6}});
    cloud.add<float>(GeometryAttribute::NORMAL, draco::DT_FLOAT32, {{0, 0}});
    const auto mesh = cloud.mesh();
    EXPECT_EQ(mesh.texcoords, (std::vector<Vector2f>{{.25f, .5f}}));
    EXPECT_TRUE(mesh.normals.empty());
    ASSERT_EQ(cloud.findings.remarks.size(), 2u);
    EXPECT_EQ(cloud.findings.remarks[0].about, "normals");
    EXPECT_TRUE(cloud.findings.remarks[0].is_loss);
    EXPECT_THAT(cloud.findings.remarks[1].text, testing::HasSubstr("2 sets of texture coordinates"));
}

TEST(DrcReading, PointsThatAreNoNumbersAreLeftOut) {
    Cloud cloud(3);
    const float none = std::nanf("");
    cloud.add<float>(GeometryAttribute::POSITION, draco::DT_FLOAT32, {{0, 1, 2}, {none, 0, 0}, {3, 4, 5}});
    cloud.add<std::uint8_t>(GeometryAttribute::COLOR, draco::DT_UINT8, {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}});
    const auto mesh = cloud.mesh();
    EXPECT_EQ(mesh.positions, (std::vector<Vector3f>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(mesh.colours, (std::vector<Colour>{{1, 1, 1}, {3, 3, 3}}));
    ASSERT_EQ(cloud.findings.remarks.size(), 1u);
    EXPECT_EQ(cloud.findings.remarks[0].about, "not-finite");
}

TEST(DrcReading, BytesBehindTheMeshAreNotLookedAt) {
    auto bytes = encoded_grid(4, draco::MESH_EDGEBREAKER_ENCODING, 0);
    bytes.insert(bytes.end(), 100, 0);
    EXPECT_TRUE(read_drc(bytes));
}

// The version before has the same layout for such clouds; the counts of older meshes are numbers of four bytes.
TEST(DrcReading, OlderBitstreamsAreReadWithTheirCountsChecked) {
    auto points = encoded_points(5, draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    points[6] = 1;
    const auto mesh = read_drc(points);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 5u);
    for (const std::uint8_t method : {std::uint8_t{0}, std::uint8_t{1}}) {
        std::vector<std::uint8_t> old{'D', 'R', 'A', 'C', 'O', 1, 1, 1, method, 0, 0};
        if (method == 1) old.insert(old.end(), {0, 9, 9, 9, 9});  // the traversal; vertices that are split
        old.insert(old.end(), {0xff, 0xff, 0xff, 0, 1, 0, 0, 0, 0, 0, 0, 0});
        ASSERT_FALSE(read_drc(old));
        EXPECT_THAT(read_drc(old).error().message, testing::HasSubstr("16777215"));
    }
}

}  // namespace
}  // namespace htvm
