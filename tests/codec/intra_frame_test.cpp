#include "codec/intra/intra_frame.h"

#include <gtest/gtest.h>

#include <limits>

#include "codec/tfan_test_meshes.h"

namespace htvm::internal {
namespace {

LatticeMesh lattice_mesh_of(const tfan_test::TestMesh& shape) {
    LatticeMesh mesh;
    mesh.positions = tfan_test::positions_of(shape, 1);
    mesh.triangles = shape.triangles;
    for (std::uint32_t k = 0; k < shape.vertex_count; ++k) {
        mesh.colours.push_back({static_cast<std::uint8_t>(k * 7), static_cast<std::uint8_t>(k), 250});
        mesh.texcoords.push_back({static_cast<std::int32_t>(k), -5});
    }
    return mesh;
}

void expect_same(const LatticeMesh& a, const LatticeMesh& b) {
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.colours, b.colours);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.texcoords, b.texcoords);
}

TEST(IntraFrame, DecodesToWhatTheEncoderSays) {
    for (const auto& shape : tfan_test::special_meshes())
        for (const std::int32_t step : {1, 32, 1 << 24})
            for (const bool merge : {false, true}) {
                SCOPED_TRACE(shape.name);
                FramePayload payload;
                const auto mesh = lattice_mesh_of(shape);
                const auto promised =
                    encode_intra_frame(mesh, {.geometry_step = step, .merge_duplicates = merge}, payload);
                ASSERT_TRUE(promised.has_value());
                const auto decoded = decode_intra_frame(view_of(payload), nullptr);
                ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
                expect_same(*decoded, *promised);
                EXPECT_EQ(payload.header.source_vertices, mesh.positions.size());
                EXPECT_EQ(payload.header.vertices, decoded->positions.size());
                if (!merge) {
                    EXPECT_EQ(decoded->positions.size(), mesh.positions.size());
                    EXPECT_EQ(decoded->triangles.size(), mesh.triangles.size());
                }
            }
}

// Colours are decoded behind the positions, and these behind their order, side by side.
TEST(IntraFrame, DecodesToTheSameOnSeveralThreadsAndRefusesTheSameDamage) {
    const ThreadPool pool(3);
    FramePayload payload;
    ASSERT_TRUE(encode_intra_frame(lattice_mesh_of(tfan_test::grid(70, 70)), {.geometry_step = 1}, payload));
    const auto decoded = decode_intra_frame(view_of(payload), nullptr, pool);
    ASSERT_TRUE(decoded) << decoded.error().message;
    ASSERT_GT(decoded->colours.size(), 4000u);
    expect_same(*decoded, *decode_intra_frame(view_of(payload), nullptr));
    for (const auto layer : {Layer::geometry, Layer::colour}) {
        auto damaged = payload;
        const auto& bytes = view_of(payload).of(layer);
        damaged.set(layer, std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + bytes.size() / 2));
        const auto alone = decode_intra_frame(view_of(damaged), nullptr);
        const auto together = decode_intra_frame(view_of(damaged), nullptr, pool);
        ASSERT_FALSE(alone);
        ASSERT_FALSE(together);
        EXPECT_EQ(together.error().message, alone.error().message);
    }
}

TEST(IntraFrame, PositionsOffTheLatticeAreRefused) {
    FramePayload payload;
    ASSERT_TRUE(encode_intra_frame(lattice_mesh_of(tfan_test::grid(3, 3)), {.geometry_step = 1}, payload).has_value());
    payload.header.geometry_step = 1 << 24;
    const auto decoded = decode_intra_frame(view_of(payload), nullptr);
    ASSERT_FALSE(decoded.has_value());
    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
}

// A coder that returns whatever the test wants.
ExternalIntraCoder coder_of(const LatticeMesh& mesh) {
    return {7, "test", [](const LatticeMesh&) { return std::vector<std::uint8_t>{1}; },
            [mesh](std::span<const std::uint8_t>) { return mesh; }};
}

TEST(IntraFrame, WhatAnExternalCoderGivesIsNotTrusted) {
    auto mesh = lattice_mesh_of(tfan_test::grid(3, 3));
    const auto good = coder_of(mesh);
    FramePayload payload;
    ASSERT_TRUE(encode_intra_frame(mesh, {.geometry_step = 1, .external = &good}, payload).has_value());
    ASSERT_TRUE(decode_intra_frame(view_of(payload), &good).has_value());
    const auto refused = [&](const LatticeMesh& given, const char* why) {
        const auto coder = coder_of(given);
        const auto decoded = decode_intra_frame(view_of(payload), &coder);
        ASSERT_FALSE(decoded.has_value()) << why;
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream) << why;
    };
    auto bad = mesh;
    bad.positions.pop_back();
    refused(bad, "too few vertices");
    bad = mesh;
    bad.triangles.push_back({0, 1, 2});
    refused(bad, "too many triangles");
    bad = mesh;
    bad.triangles[0][0] = 9;
    refused(bad, "an index out of range");
    bad = mesh;
    bad.colours.pop_back();
    refused(bad, "too few colours");
    bad = mesh;
    bad.positions[0].x = lattice_limit + 1;
    refused(bad, "off the lattice");
    bad.positions[0].x = std::numeric_limits<std::int32_t>::min();
    refused(bad, "off the lattice, where the absolute value overflows");
    bad = mesh;
    bad.texcoords[0][0] = std::numeric_limits<std::int32_t>::min();
    refused(bad, "a texture coordinate out of range");
    auto other = good;
    other.number = 8;
    EXPECT_EQ(decode_intra_frame(view_of(payload), &other).error().kind, ErrorKind::unsupported);
    EXPECT_EQ(decode_intra_frame(view_of(payload), nullptr).error().kind, ErrorKind::unsupported);
}

}  // namespace
}  // namespace htvm::internal
