#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "codec/intra/neighbours.h"
#include "codec/intra_test_meshes.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

using Edge = std::set<std::uint32_t>;

// What holds for every row: distinct, earlier, adjacent, bounded.
void expect_rows_hold(const intra_test::Connectivity& mesh, const Neighbours& neighbours) {
    ASSERT_EQ(neighbours.vertex_count(), mesh.vertex_count);
    std::vector<std::size_t> rank_of(mesh.vertex_count, mesh.vertex_count);
    std::set<Edge> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t i = 0; i < 3; ++i) edges.insert({t[i], t[(i + 1) % 3]});
    for (std::size_t rank = 0; rank < mesh.vertex_count; ++rank) {
        const std::uint32_t v = neighbours.order[rank];
        ASSERT_EQ(rank_of[v], mesh.vertex_count) << "a vertex comes twice";
        rank_of[v] = rank;
        const auto around = neighbours.neighbours_of(rank);
        EXPECT_LE(around.size(), row_limit);
        EXPECT_EQ(std::set(around.begin(), around.end()).size(), around.size());
        for (const auto n : around) {
            EXPECT_LT(rank_of[n], rank);
            EXPECT_TRUE(edges.contains({v, n}));
        }
        EXPECT_LE(neighbours.parallelograms_of(rank).size(), row_limit);
        for (const auto& p : neighbours.parallelograms_of(rank)) {
            for (const auto n : {p.a, p.b, p.opposite}) EXPECT_LT(rank_of[n], rank);
            EXPECT_EQ((std::set{p.a, p.b, p.opposite, v}).size(), 4u);
            EXPECT_TRUE(edges.contains({v, p.a}) && edges.contains({v, p.b}));
            EXPECT_TRUE(edges.contains({p.opposite, p.a}) && edges.contains({p.opposite, p.b}));
            EXPECT_TRUE(p.across ? edges.contains({p.a, p.b}) : edges.contains({v, p.opposite}));
        }
    }
}

TEST(Neighbours, OrderEveryVertexOnceAndNameOnlyEarlierAdjacentOnes) {
    for (const auto& mesh : intra_test::awkward()) {
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        ASSERT_TRUE(neighbours);
        expect_rows_hold(mesh, *neighbours);
    }
}

TEST(Neighbours, TheRoomForTheirRowsIsEnoughForAnyTriangles) {
    for (const auto& mesh : intra_test::awkward()) {
        const auto corners = find_corners(mesh.triangles, mesh.vertex_count);
        ASSERT_TRUE(corners);
        auto rows = empty_rows(*corners), roomy = rows;
        roomy.parallelograms.resize(row_limit * mesh.vertex_count);
        roomy.neighbours.resize(row_limit * mesh.vertex_count);
        order_vertices(*corners, {}, rows);
        order_vertices(*corners, {}, roomy);
        EXPECT_EQ(rows.order, roomy.order);
        EXPECT_EQ(rows.first_neighbour, roomy.first_neighbour);
        EXPECT_EQ(rows.first_parallelogram, roomy.first_parallelogram);
    }
}

TEST(Neighbours, WhoFollowsTheirOrderSeesWholeRows) {
    const auto mesh = intra_test::grid(100);
    const auto expected = find_neighbours(mesh.triangles, mesh.vertex_count);
    const auto corners = find_corners(mesh.triangles, mesh.vertex_count, ThreadPool(3));
    ASSERT_TRUE(expected && corners);
    auto rows = empty_rows(*corners);
    Progress ordered;
    parallel_invoke(
        ThreadPool(2),
        [&] {
            const EndOfProgress end{ordered};
            order_vertices(*corners, {}, rows, &ordered);
        },
        [&] {
            Followed others(&ordered);
            for (std::size_t rank = 0; rank < mesh.vertex_count; ++rank) {
                others.wait_beyond(rank);
                ASSERT_EQ(rows.order[rank], expected->order[rank]);
                const auto around = rows.neighbours_of(rank), wanted = expected->neighbours_of(rank);
                ASSERT_TRUE(std::equal(around.begin(), around.end(), wanted.begin(), wanted.end()));
                ASSERT_EQ(rows.parallelograms_of(rank).size(), expected->parallelograms_of(rank).size());
            }
        });
}

TEST(Neighbours, OfCornersFoundByThreadsAreThoseOfOne) {
    const auto mesh = intra_test::grid(200);
    const auto one = find_corners(mesh.triangles, mesh.vertex_count);
    const auto three = find_corners(mesh.triangles, mesh.vertex_count, ThreadPool(3));
    ASSERT_TRUE(one && three);
    EXPECT_EQ(one->opposite, three->opposite);
    EXPECT_EQ(one->paired_edges, three->paired_edges);
}

TEST(Neighbours, TheFourthCornerOfTwoTrianglesHasOneParallelogram) {
    const std::vector<Triangle> triangles{{0, 1, 2}, {2, 1, 3}};
    const auto neighbours = find_neighbours(triangles, 4);
    ASSERT_TRUE(neighbours);
    ASSERT_EQ(neighbours->parallelograms.size(), 1u);
    EXPECT_EQ(neighbours->parallelograms_of(3).size(), 1u);
}

TEST(Neighbours, InAPatchMostVerticesHaveThreeParallelograms) {
    const auto mesh = intra_test::grid(30);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    ASSERT_TRUE(neighbours);
    std::size_t three = 0;
    for (std::size_t rank = 0; rank < mesh.vertex_count; ++rank)
        three += neighbours->parallelograms_of(rank).size() >= 3;
    EXPECT_GT(three, mesh.vertex_count * 8 / 10);
}

TEST(Neighbours, ATriangleBeyondTheVerticesIsAnError) {
    const std::vector<Triangle> triangles{{0, 1, 3}};
    const auto neighbours = find_neighbours(triangles, 3);
    ASSERT_FALSE(neighbours);
    EXPECT_EQ(neighbours.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm::internal
