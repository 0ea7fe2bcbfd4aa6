// Triangles that are there twice, or wound either way.
#include "surface/triangle_cleaning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

namespace htvm::internal {
namespace {

struct Surface {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
};

// A cube with two triangles a side, all seen from outside.
Surface cube(std::int32_t at = 0) {
    Surface out;
    for (std::int32_t i = 0; i < 8; ++i)
        out.positions.push_back({at + 100 * (i & 1), 100 * (i >> 1 & 1), 100 * (i >> 2 & 1)});
    out.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return out;
}

Triangle other_way_round(Triangle t) {
    std::swap(t[1], t[2]);
    return t;
}

// Beginning with the smallest corner, so that only the winding is left to differ.
Triangle turned_to_smallest(Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

std::set<Triangle> as_set(const std::vector<Triangle>& triangles) {
    std::set<Triangle> out;
    for (const auto& t : triangles) out.insert(turned_to_smallest(t));
    return out;
}

TEST(TriangleCleaning, LeavesACleanSurfaceAsItIs) {
    const auto surface = cube();
    const auto cleaned = clean_triangles(surface.positions, surface.triangles);
    EXPECT_EQ(cleaned.triangles, surface.triangles);
    EXPECT_EQ(cleaned.doubled, 0u);
    EXPECT_EQ(cleaned.turned, 0u);
    EXPECT_FALSE(needs_cleaning(cleaned, surface.triangles.size()));
}

TEST(TriangleCleaning, TurnsTheFewToTheManyOfTheirPiece) {
    const auto surface = cube();
    auto mixed = surface;
    for (const std::size_t t : {3u, 4u, 9u}) mixed.triangles[t] = other_way_round(mixed.triangles[t]);
    const auto cleaned = clean_triangles(mixed.positions, mixed.triangles);
    EXPECT_EQ(as_set(cleaned.triangles), as_set(surface.triangles));
    EXPECT_EQ(cleaned.turned, 3u);
    EXPECT_TRUE(needs_cleaning(cleaned, mixed.triangles.size()));
}

TEST(TriangleCleaning, KeepsAnInsideOutSurfaceWhichIsOfOneMind) {
    auto surface = cube();
    for (auto& t : surface.triangles) t = other_way_round(t);
    EXPECT_EQ(clean_triangles(surface.positions, surface.triangles).turned, 0u);
}

TEST(TriangleCleaning, FacesOutwardsWhereTheWindingIsInDoubt) {
    const auto surface = cube();
    auto mixed = surface;
    for (std::size_t t = 0; t < 12; t += 2) mixed.triangles[t] = other_way_round(mixed.triangles[t]);
    EXPECT_EQ(as_set(clean_triangles(mixed.positions, mixed.triangles).triangles), as_set(surface.triangles));
}

TEST(TriangleCleaning, KeepsOneOfTwoSidesTheOneThatIsSeenFromOutside) {
    const auto surface = cube();
    auto doubled = surface;
    doubled.triangles.clear();
    for (const auto& t : surface.triangles) doubled.triangles.push_back(other_way_round(t));
    doubled.triangles.insert(doubled.triangles.end(), surface.triangles.begin(), surface.triangles.end());
    const auto cleaned = clean_triangles(doubled.positions, doubled.triangles);
    EXPECT_EQ(cleaned.doubled, 12u);
    EXPECT_EQ(as_set(cleaned.triangles), as_set(surface.triangles));
}

TEST(TriangleCleaning, SeesThroughSeamsWhereCornersHaveVerticesOfTheirOwn) {
    const auto surface = cube();
    Surface soup;
    for (const auto& t : surface.triangles)
        for (const auto v : t) soup.positions.push_back(surface.positions[v]);
    for (std::uint32_t t = 0; t < 12; ++t) soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    soup.triangles[5] = other_way_round(soup.triangles[5]);
    const auto cleaned = clean_triangles(soup.positions, soup.triangles);
    EXPECT_EQ(cleaned.turned, 1u);
    EXPECT_EQ(cleaned.triangles[5], (Triangle{15, 16, 17}));
}

TEST(TriangleCleaning, JudgesEachPieceByItself) {
    auto surface = cube();
    const auto other = cube(1000);
    for (const auto& p : other.positions) surface.positions.push_back(p);
    for (const auto& t : other.triangles) surface.triangles.push_back(other_way_round({t[0] + 8, t[1] + 8, t[2] + 8}));
    EXPECT_EQ(clean_triangles(surface.positions, surface.triangles).turned, 0u) << "each is of one mind";
}

TEST(TriangleCleaning, TakesForkedEdgesCollapsedTrianglesAndNothing) {
    auto surface = cube();
    surface.triangles.push_back({0, 1, 7});  // a third triangle at an edge
    surface.triangles.push_back({4, 4, 5});
    surface.triangles.push_back({4, 4, 5});
    const auto cleaned = clean_triangles(surface.positions, surface.triangles);
    EXPECT_EQ(cleaned.doubled, 0u) << "collapsed triangles are nobody's double";
    EXPECT_EQ(cleaned.triangles.size(), 15u);
    EXPECT_TRUE(clean_triangles({}, {}).triangles.empty());
}

}  // namespace
}  // namespace htvm::internal
