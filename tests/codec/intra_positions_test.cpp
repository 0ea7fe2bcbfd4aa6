#include <gtest/gtest.h>

#include "codec/intra/positions.h"
#include "codec/intra_test_meshes.h"

namespace htvm::internal {
namespace {

TEST(IntraPositions, EveryMeshComesBackExactly) {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        ASSERT_TRUE(neighbours);
        const auto q = intra_test::points(mesh.vertex_count, seed++);
        const auto decoded = decode_intra_positions(encode_intra_positions(q, *neighbours), *neighbours);
        ASSERT_TRUE(decoded) << decoded.error().message;
        EXPECT_EQ(*decoded, q);
    }
}

TEST(IntraPositions, AMeshWithoutVerticesTakesNoBytes) {
    EXPECT_TRUE(encode_intra_positions({}, Neighbours{}).empty());
}

TEST(IntraPositions, AFlatRegularPatchCostsNextToNothing) {
    const auto mesh = intra_test::grid(60);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    std::vector<LatticePoint> q;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(mesh.vertex_count); ++i)
        q.push_back({i % 61 * 8, i / 61 * 8, 5});
    EXPECT_LT(encode_intra_positions(q, *neighbours).size(), 300u);
}

TEST(IntraPositions, ALayerCutShortIsAnError) {
    const auto mesh = intra_test::grid(20);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const auto bytes = encode_intra_positions(intra_test::points(mesh.vertex_count, 1), *neighbours);
    for (std::size_t size = 0; size + 8 < bytes.size(); ++size) {
        const auto decoded = decode_intra_positions(std::span(bytes).first(size), *neighbours);
        ASSERT_FALSE(decoded) << size;
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(IntraPositions, DamagedBytesGiveAnErrorOrPointsOnTheLattice) {
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        const auto mesh = seed % 2 ? intra_test::grid(10) : intra_test::soup(random);
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        auto bytes = encode_intra_positions(intra_test::points(mesh.vertex_count, seed), *neighbours);
        for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        const auto decoded = decode_intra_positions(bytes, *neighbours);
        if (!decoded) continue;
        for (const auto& p : *decoded) EXPECT_TRUE(on_lattice(p));
    }
}

}  // namespace
}  // namespace htvm::internal
