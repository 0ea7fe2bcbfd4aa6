#include "codec/intra/tfan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "codec/tfan_test_meshes.h"

namespace htvm::internal {
namespace {

using tfan_test::as_multiset;
using tfan_test::TestMesh;

// Checks everything that encode_tfan promises on one mesh.
void expect_comes_back(const TestMesh& mesh) {
    SCOPED_TRACE(mesh.name);
    const auto encoded = encode_tfan(mesh.vertex_count, mesh.triangles);
    ASSERT_EQ(encoded.order.size(), mesh.vertex_count);
    auto sorted = encoded.order;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> all(mesh.vertex_count);
    std::iota(all.begin(), all.end(), 0u);
    EXPECT_EQ(sorted, all) << "order is not a permutation";

    const auto decoded =
        decode_tfan(encoded.bytes, mesh.vertex_count, static_cast<std::uint32_t>(mesh.triangles.size()));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    EXPECT_EQ(*decoded, encoded.triangles);
    auto renumbered = *decoded;
    for (auto& triangle : renumbered)
        for (auto& vertex : triangle) vertex = encoded.order[vertex];
    EXPECT_EQ(as_multiset(renumbered), as_multiset(mesh.triangles));
}

TEST(Tfan, NothingTakesNoBytes) {
    EXPECT_TRUE(encode_tfan(0, {}).bytes.empty());
    EXPECT_TRUE(encode_tfan(7, {}).bytes.empty());
    EXPECT_EQ(decode_tfan({}, 7, 0).value().size(), 0u);
}

TEST(Tfan, OneTriangleIsTurnedToItsLowestVertexAndKeepsItsOrientation) {
    const std::vector<Triangle> triangles = {{4, 2, 3}};
    const auto encoded = encode_tfan(6, triangles);
    EXPECT_EQ(encoded.order, (std::vector<std::uint32_t>{2, 3, 4, 0, 1, 5}));
    EXPECT_EQ(encoded.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(Tfan, IsolatedVerticesComeLastAndCostNothing) {
    const std::vector<Triangle> triangles = {{1, 3, 5}, {5, 3, 7}};
    const std::vector<Triangle> compact = {{0, 1, 2}, {2, 1, 3}};
    EXPECT_EQ(encode_tfan(9, triangles).bytes, encode_tfan(4, compact).bytes);
}

TEST(Tfan, EveryKindOfMeshComesBackExactly) {
    for (const auto& mesh : tfan_test::special_meshes()) expect_comes_back(mesh);
}

TEST(Tfan, RandomTriangleSoupsComeBackExactly) {
    for (unsigned seed = 0; seed < 400; ++seed) expect_comes_back(tfan_test::random_soup(seed));
}

TEST(Tfan, AHubOfTwentyThousandTrianglesComesBackExactly) {
    expect_comes_back(tfan_test::fan(20000, true));
    expect_comes_back(tfan_test::fan(20000, false));
    expect_comes_back(tfan_test::shuffled_hub(20000));
}

TEST(Tfan, ARegularGridTakesFarLessThanABitPerVertex) {
    const auto grid = tfan_test::grid(100, 100);
    EXPECT_LT(encode_tfan(grid.vertex_count, grid.triangles).bytes.size() * 8, grid.vertex_count / 4);
}

TEST(Tfan, TheInputsTriangleOrderDoesNotChangeWhichTrianglesComeBack) {
    auto mesh = tfan_test::perturbed_sphere(12, 20, 3);
    std::mt19937 random(5);
    for (int i = 0; i < 5; ++i) {
        std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
        expect_comes_back(mesh);
    }
}

TEST(Tfan, TruncatedOrEmptyBytesAreReportedAsCorrupt) {
    const auto mesh = tfan_test::perturbed_sphere(20, 30, 1);
    const auto encoded = encode_tfan(mesh.vertex_count, mesh.triangles);
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, encoded.bytes.size() / 2}) {
        const auto decoded = decode_tfan(std::span(encoded.bytes).first(size), mesh.vertex_count, count);
        if (!decoded) {
            EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
        } else {
            EXPECT_NE(*decoded, encoded.triangles);
        }
    }
}

TEST(Tfan, TrianglesWithoutVerticesAreReportedAsCorrupt) {
    const auto decoded = decode_tfan({}, 0, 5);
    ASSERT_FALSE(decoded.has_value());
    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
}

TEST(Tfan, DamagedBytesNeverNameAVertexThatDoesNotExist) {
    std::mt19937 random(11);
    for (unsigned seed = 0; seed < 300; ++seed) {
        const auto mesh = seed % 3 == 0 ? tfan_test::perturbed_sphere(10, 12, seed) : tfan_test::random_soup(seed);
        auto bytes = encode_tfan(mesh.vertex_count, mesh.triangles).bytes;
        const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
        for (int i = 0; i < 20; ++i) {
            auto damaged = tfan_test::damage(bytes, random);
            const auto decoded = decode_tfan(damaged, mesh.vertex_count, count);
            if (!decoded) continue;
            EXPECT_EQ(decoded->size(), count);
            for (const auto& triangle : *decoded)
                for (const auto vertex : triangle) EXPECT_LT(vertex, mesh.vertex_count);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
