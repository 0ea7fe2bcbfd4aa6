#include "codec/reference/vertex_hierarchy.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "codec/intra_test_meshes.h"
#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm::internal {
namespace {

// What must hold for every hierarchy: each node of a finer level is joined exactly once, counts and rows are in order.
void expect_sound(const VertexHierarchy& hierarchy, std::size_t vertex_count) {
    ASSERT_EQ(hierarchy.vertex_count, vertex_count);
    std::size_t finer = vertex_count;
    std::vector<std::uint32_t> below(vertex_count, 1);
    for (const HierarchyLevel& level : hierarchy.levels) {
        ASSERT_LE(level.size(), finer - finer / 4 + 1);
        ASSERT_LT(level.size(), finer);
        ASSERT_EQ(level.second.size(), level.size());
        ASSERT_EQ(level.vertices.size(), level.size());
        ASSERT_EQ(level.second_share.size(), level.size());
        ASSERT_EQ(level.split_scale.size(), level.size());
        ASSERT_EQ(level.first_neighbour.size(), level.size() + 1);
        ASSERT_EQ(level.slopes.size(), level.neighbours.size());
        ASSERT_EQ(level.first_neighbour.back(), level.neighbours.size());
        std::vector<int> joined(finer, 0);
        for (std::size_t p = 0; p < level.size(); ++p) {
            const bool pair = level.second[p] != no_node;
            ++joined.at(level.first[p]);
            if (pair) ++joined.at(level.second[p]);
            EXPECT_EQ(level.vertices[p], below[level.first[p]] + (pair ? below[level.second[p]] : 0));
            EXPECT_EQ(level.split_scale[p] > 0, pair);
            ASSERT_LE(level.first_neighbour[p], level.first_neighbour[p + 1]);
            EXPECT_LE(level.first_neighbour[p + 1] - level.first_neighbour[p], hierarchy_row_limit);
            for (std::uint32_t i = level.first_neighbour[p]; i < level.first_neighbour[p + 1]; ++i) {
                EXPECT_LT(level.neighbours[i], level.size());
                EXPECT_NE(level.neighbours[i], p);
                EXPECT_LE(std::abs(level.slopes[i]), 1 << 15);
                const auto first = level.first_neighbour[level.neighbours[i]],
                           end = level.first_neighbour[level.neighbours[i] + 1];
                EXPECT_TRUE(!level.mutual ||
                            std::count(level.neighbours.begin() + first, level.neighbours.begin() + end, p) == 1);
            }
        }
        for (const int times : joined) EXPECT_EQ(times, 1);
        finer = level.size();
        below = level.vertices;
    }
    EXPECT_EQ(finer, vertex_count < 2 ? vertex_count : 1);
}

TEST(VertexHierarchy, JoinsEveryVertexOnceALevelWhateverTheMesh) {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const auto points = intra_test::points(mesh.vertex_count, seed++);
        const auto hierarchy = build_vertex_hierarchy(points, mesh.triangles);
        ASSERT_TRUE(hierarchy) << hierarchy.error().message;
        expect_sound(*hierarchy, mesh.vertex_count);
    }
}

TEST(VertexHierarchy, HasFewLevelsEvenWhereVerticesAreIsolatedOrAllRoundOne) {
    const std::vector<LatticePoint> points = intra_test::points(10000, 1);
    const auto isolated = build_vertex_hierarchy(points, {});
    ASSERT_TRUE(isolated);
    EXPECT_LE(isolated->levels.size(), 16u);
    const auto star = intra_test::fans(9998);
    const auto hub = build_vertex_hierarchy(points, star.triangles);
    ASSERT_TRUE(hub);
    EXPECT_LE(hub->levels.size(), 30u);
}

TEST(VertexHierarchy, HalvesARegularPatch) {
    const auto mesh = intra_test::grid(63);
    const auto hierarchy = build_vertex_hierarchy(intra_test::points(mesh.vertex_count, 1), mesh.triangles);
    ASSERT_TRUE(hierarchy);
    EXPECT_LE(hierarchy->levels[0].size(), 64u * 64 * 11 / 20);
    EXPECT_LE(hierarchy->levels.size(), 15u);
}

TEST(VertexHierarchy, SlopesFindTheDifferenceOfALinearField) {
    const auto mesh = intra_test::grid(20);
    std::vector<LatticePoint> points(mesh.vertex_count);
    for (std::size_t i = 0; i < points.size(); ++i)
        points[i] = {static_cast<std::int32_t>(i % 21) * 100, static_cast<std::int32_t>(i / 21) * 100, 0};
    const auto hierarchy = build_vertex_hierarchy(points, mesh.triangles);
    ASSERT_TRUE(hierarchy);
    const HierarchyLevel& level = hierarchy->levels[0];
    auto mean = [&](std::size_t p) {
        const double first = points[level.first[p]].x;
        return level.second[p] == no_node ? first : (first + points[level.second[p]].x) / 2;
    };
    double off = 0, all = 0;
    for (std::size_t p = 0; p < level.size(); ++p) {
        if (level.second[p] == no_node) continue;
        double predicted = 0;
        for (std::uint32_t i = level.first_neighbour[p]; i < level.first_neighbour[p + 1]; ++i)
            predicted += level.slopes[i] * (mean(level.neighbours[i]) - mean(p)) / (1 << slope_bits);
        const double actual = points[level.first[p]].x - points[level.second[p]].x;
        off += std::abs(predicted - actual);
        all += std::abs(actual);
    }
    EXPECT_LT(off, 0.1 * all);
}

TEST(VertexHierarchy, IsTheSameOnEveryMachine) {
    std::uint32_t digest = 0;
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const auto hierarchy = build_vertex_hierarchy(intra_test::points(mesh.vertex_count, seed++), mesh.triangles);
        ByteWriter writer;
        writer.u32(digest);
        for (const HierarchyLevel& level : hierarchy->levels) {
            for (const auto* numbers : {&level.first, &level.second, &level.vertices, &level.second_share,
                                        &level.first_neighbour, &level.neighbours})
                for (const std::uint32_t number : *numbers) writer.u32(number);
            for (const std::uint16_t scale : level.split_scale) writer.u16(scale);
            for (const std::int32_t slope : level.slopes) writer.signed_varint(slope);
        }
        digest = crc32(writer.data());
    }
    EXPECT_EQ(digest, 982336371u);
}

TEST(VertexHierarchy, RefusesWhatIsNoMeshOnTheLattice) {
    const std::vector<LatticePoint> points(3);
    const std::vector<Triangle> beyond{{0, 1, 3}};
    EXPECT_EQ(build_vertex_hierarchy(points, beyond).error().kind, ErrorKind::bad_input);
    const std::vector<LatticePoint> far{{lattice_limit + 1, 0, 0}};
    EXPECT_EQ(build_vertex_hierarchy(far, {}).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm::internal
