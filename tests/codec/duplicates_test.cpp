#include "codec/intra/duplicates.h"

#include <gtest/gtest.h>

#include <random>

#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

using test::below;

// Few places and few values, so that many vertices are equal.
LatticeMesh crowded(std::size_t count, bool colours, bool normals, bool texcoords, unsigned seed) {
    std::mt19937 random(seed);
    LatticeMesh out;
    for (std::size_t k = 0; k < count; ++k) {
        const auto c = [&](std::uint32_t n) { return static_cast<std::int32_t>(below(random, n)); };
        out.positions.push_back({c(3) - 1, c(4), -c(2)});
        if (colours) out.colours.push_back({static_cast<std::uint8_t>(c(2)), 0, 9});
        if (normals) out.normals.push_back({c(2), 0, 127});
        if (texcoords) out.texcoords.push_back({0, c(2)});
    }
    return out;
}

bool same(const LatticeMesh& mesh, std::size_t a, std::size_t b) {
    return mesh.positions[a] == mesh.positions[b] && (mesh.colours.empty() || mesh.colours[a] == mesh.colours[b]) &&
           (mesh.normals.empty() || mesh.normals[a] == mesh.normals[b]) &&
           (mesh.texcoords.empty() || mesh.texcoords[a] == mesh.texcoords[b]);
}

TEST(Duplicates, AreWhatBruteForceFinds) {
    for (unsigned seed = 0; seed < 64; ++seed) {
        const auto mesh = crowded(seed * 5, seed & 1, seed & 2, seed & 4, seed);
        const auto merging = find_duplicates(mesh);
        std::vector<std::uint32_t> kept, number;
        for (std::uint32_t k = 0; k < mesh.positions.size(); ++k) {
            std::uint32_t at = 0;
            while (at < kept.size() && !same(mesh, kept[at], k)) ++at;
            if (at == kept.size()) kept.push_back(k);
            number.push_back(at);
        }
        EXPECT_EQ(merging.kept, kept);
        EXPECT_EQ(merging.number, number);
    }
}

TEST(Duplicates, ManyDifferentVerticesAtOnePointAreFoundInLinearTime) {
    LatticeMesh mesh;
    constexpr std::uint32_t count = 300000;  // with quadratic time, this would take minutes
    mesh.positions.assign(count, {1, 2, 3});
    for (std::uint32_t k = 0; k < count; ++k)
        mesh.colours.push_back(
            {static_cast<std::uint8_t>(k), static_cast<std::uint8_t>(k >> 8), static_cast<std::uint8_t>(k >> 16)});
    EXPECT_EQ(find_duplicates(mesh).kept.size(), count);
}

TEST(Duplicates, NoneAtAllIsOneToOne) {
    const auto merging = no_duplicates(3);
    EXPECT_EQ(merging.kept, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(merging.number, merging.kept);
    EXPECT_TRUE(find_duplicates({}).kept.empty());
}

TEST(Duplicates, TrianglesFollowAndCollapsedOnesAreDroppedOnRequest) {
    Merging merging;
    merging.number = {0, 1, 0, 2};
    const std::vector<Triangle> triangles = {{0, 1, 3}, {0, 1, 2}, {2, 3, 1}, {1, 1, 3}};
    EXPECT_EQ(merged_triangles(triangles, merging, true), (std::vector<Triangle>{{0, 1, 2}, {0, 2, 1}}));
    EXPECT_EQ(merged_triangles(triangles, merging, false),
              (std::vector<Triangle>{{0, 1, 2}, {0, 1, 0}, {0, 2, 1}, {1, 1, 2}}));
}

TEST(Duplicates, KeptVerticesKeepTheirAttributes) {
    const auto mesh = crowded(20, true, false, true, 1);
    const auto out = kept_vertices(mesh, {3, 17});
    EXPECT_EQ(out.positions, (std::vector<LatticePoint>{mesh.positions[3], mesh.positions[17]}));
    EXPECT_EQ(out.colours, (std::vector<Colour>{mesh.colours[3], mesh.colours[17]}));
    EXPECT_TRUE(out.normals.empty());
    EXPECT_EQ(out.texcoords[1], mesh.texcoords[17]);
}

}  // namespace
}  // namespace htvm::internal
