#include "codec/bones/mtfan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "codec/tfan_test_meshes.h"

namespace htvm::internal {
namespace {

using tfan_test::as_multiset;
using tfan_test::TestMesh;

// Checks everything that encode_mtfan promises on one mesh.
void expect_comes_back(const TestMesh& mesh, int m, unsigned seed) {
    SCOPED_TRACE(mesh.name + " with m = " + std::to_string(m));
    const auto positions = tfan_test::positions_of(mesh, seed);
    const auto encoded = encode_mtfan(positions, mesh.triangles, m, {});
    const auto decoded = decode_mtfan(encoded.fans, encoded.distance_orders, positions,
                                      static_cast<std::uint32_t>(mesh.triangles.size()), m, {});
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    EXPECT_EQ(*decoded, encoded.triangles);
    EXPECT_EQ(as_multiset(*decoded), as_multiset(mesh.triangles));
    EXPECT_EQ(encoded.distance_order_counts.size(), static_cast<std::size_t>(m) + 1);
}

TEST(Mtfan, NothingTakesNoBytes) {
    const std::vector<LatticePoint> positions(3);
    for (const auto& points : {std::vector<LatticePoint>{}, positions}) {
        const auto encoded = encode_mtfan(points, {}, 16, {});
        EXPECT_TRUE(encoded.fans.empty());
        EXPECT_TRUE(encoded.distance_orders.empty());
        EXPECT_EQ(decode_mtfan({}, {}, points, 0, 16, {}).value().size(), 0u);
    }
}

TEST(Mtfan, VerticesKeepTheirNumbers) {
    const std::vector<LatticePoint> positions = {{9, 0, 0}, {0, 0, 0}, {0, 9, 0}, {99, 0, 0}};
    const std::vector<Triangle> triangles = {{2, 1, 3}};
    EXPECT_EQ(encode_mtfan(positions, triangles, 8, {}).triangles, (std::vector<Triangle>{{1, 3, 2}}));
}

TEST(Mtfan, TheDistanceOrderCountsOnlyVerticesNotYetVisited) {
    // Seen from vertex 0, the others are increasingly far: each is the nearest of those left.
    const std::vector<LatticePoint> positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {-3, 0, 0}, {0, -4, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
    EXPECT_EQ(encode_mtfan(positions, triangles, 4, {}).distance_order_counts,
              (std::vector<std::uint32_t>{4, 0, 0, 0, 0}));
    const std::vector<Triangle> backwards = {{0, 4, 3}, {0, 3, 2}, {0, 2, 1}};
    EXPECT_EQ(encode_mtfan(positions, backwards, 4, {}).distance_order_counts,
              (std::vector<std::uint32_t>{1, 1, 1, 1, 0}));
}

TEST(Mtfan, AVertexBeyondTheNearestIsCodedByItsIndex) {
    const std::vector<LatticePoint> positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {-3, 0, 0}, {0, -4, 0}};
    const std::vector<Triangle> backwards = {{0, 4, 3}, {0, 3, 2}, {0, 2, 1}};
    EXPECT_EQ(encode_mtfan(positions, backwards, 2, {}).distance_order_counts, (std::vector<std::uint32_t>{1, 1, 2}));
}

TEST(Mtfan, EveryKindOfMeshComesBackExactly) {
    for (const auto& mesh : tfan_test::special_meshes())
        for (const int m : {1, 7, 8, 9, 16, 64}) expect_comes_back(mesh, m, 1);
}

TEST(Mtfan, RandomTriangleSoupsComeBackExactly) {
    for (unsigned seed = 0; seed < 300; ++seed)
        expect_comes_back(tfan_test::random_soup(seed), 1 + static_cast<int>(seed % 40), seed);
}

TEST(Mtfan, EqualPositionsComeBackExactly) {
    auto mesh = tfan_test::perturbed_sphere(12, 14, 6);
    std::fill(mesh.positions.begin(), mesh.positions.end(), LatticePoint{5, 5, 5});
    expect_comes_back(mesh, 16, 0);
}

TEST(Mtfan, PositionsAtTheLatticesCornersComeBackExactly) {
    auto mesh = tfan_test::perturbed_sphere(12, 14, 6);
    std::mt19937 random(1);
    const auto corner = [&] { return random() % 2 ? lattice_limit : -lattice_limit; };
    for (auto& p : mesh.positions) p = {corner(), corner(), corner()};
    expect_comes_back(mesh, 16, 0);
}

TEST(Mtfan, AHubOfTwentyThousandTrianglesComesBackExactly) {
    expect_comes_back(tfan_test::fan(20000, true), 16, 2);
    expect_comes_back(tfan_test::shuffled_hub(20000), 16, 2);
}

TEST(Mtfan, BytesDoNotDependOnTheNumberOfThreads) {
    const auto mesh = tfan_test::perturbed_sphere(80, 90, 1);
    const auto one = encode_mtfan(mesh.positions, mesh.triangles, 16, {});
    for (const unsigned threads : {0u, 2u, 5u}) {
        const ThreadPool pool(threads);
        const auto many = encode_mtfan(mesh.positions, mesh.triangles, 16, pool);
        EXPECT_EQ(many.fans, one.fans);
        EXPECT_EQ(many.distance_orders, one.distance_orders);
        const auto decoded = decode_mtfan(one.fans, one.distance_orders, mesh.positions,
                                          static_cast<std::uint32_t>(mesh.triangles.size()), 16, pool);
        ASSERT_TRUE(decoded.has_value());
        EXPECT_EQ(*decoded, one.triangles);
    }
}

TEST(Mtfan, AnImpossibleNumberOfNearestIsReportedAsCorrupt) {
    const std::vector<LatticePoint> positions(3);
    for (const int m : {-1, 0, 65, 1 << 30}) {
        const auto decoded = decode_mtfan({}, {}, positions, 1, m, {});
        ASSERT_FALSE(decoded.has_value());
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(Mtfan, TrianglesWithoutVerticesAreReportedAsCorrupt) {
    const auto decoded = decode_mtfan({}, {}, {}, 5, 8, {});
    ASSERT_FALSE(decoded.has_value());
    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
}

TEST(Mtfan, DamagedBytesNeverNameAVertexThatDoesNotExist) {
    std::mt19937 random(12);
    for (unsigned seed = 0; seed < 200; ++seed) {
        const auto mesh = seed % 2 == 0 ? tfan_test::perturbed_sphere(10, 12, seed) : tfan_test::random_soup(seed);
        const auto positions = tfan_test::positions_of(mesh, seed);
        const auto encoded = encode_mtfan(positions, mesh.triangles, 8, {});
        const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
        for (int i = 0; i < 20; ++i) {
            const auto fans = i % 3 == 0 ? encoded.fans : tfan_test::damage(encoded.fans, random);
            const auto orders =
                i % 3 == 1 ? encoded.distance_orders : tfan_test::damage(encoded.distance_orders, random);
            const auto decoded = decode_mtfan(fans, orders, positions, count, 8, {});
            if (!decoded) continue;
            EXPECT_EQ(decoded->size(), count);
            for (const auto& triangle : *decoded)
                for (const auto vertex : triangle) EXPECT_LT(vertex, mesh.vertex_count);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
