// Where a surface ends.
#include "metrics/surface_border.h"

#include <gtest/gtest.h>

#include "metrics/shapes.h"

namespace htvm {
namespace {

TEST(SurfaceBorder, OfASheetIsItsFourSides) {
    const SurfaceBorder border(shapes::plane(100, 10, 0));
    EXPECT_EQ(border.border_edges(), 40u);
    EXPECT_EQ(border.edges(), 320u);
}

TEST(SurfaceBorder, HasWhatLiesOnAnEdgeOfOneTriangleAndOnItsEnds) {
    // Two triangles of a square: 0 1 3 and 0 3 2; the diagonal is within.
    const Mesh square = shapes::plane(10, 1, 0);
    ASSERT_EQ(square.triangles[0], (Triangle{0, 1, 3}));
    const SurfaceBorder border(square);
    EXPECT_TRUE(border.has(0, {0.5, 0.5, 0}));
    EXPECT_TRUE(border.has(0, {0, 0.5, 0.5}));
    EXPECT_FALSE(border.has(0, {0.5, 0, 0.5})) << "the diagonal";
    EXPECT_TRUE(border.has(0, {1, 0, 0}));
    EXPECT_FALSE(border.has(0, {0.4, 0.3, 0.3}));
}

TEST(SurfaceBorder, OfAClosedSurfaceIsNothing) {
    const SurfaceBorder border(shapes::sphere(100, 2));
    EXPECT_EQ(border.border_edges(), 0u);
    EXPECT_FALSE(border.has(0, {1, 0, 0}));
}

TEST(SurfaceBorder, IsNotASeamWhereVerticesAreThereTwice) {
    Mesh cut;
    for (const auto& t : shapes::sphere(100, 2).triangles) {
        const Mesh ball = shapes::sphere(100, 2);
        const auto v = static_cast<std::uint32_t>(cut.positions.size());
        for (const auto corner : t) cut.positions.push_back(ball.positions[corner]);
        cut.triangles.push_back({v, v + 1, v + 2});
    }
    EXPECT_EQ(SurfaceBorder(cut).border_edges(), 0u);
}

TEST(SurfaceBorder, OfASheetWithTwoSidesIsThatOfTheSheet) {
    Mesh sheet = shapes::plane(100, 10, 0);
    const auto front = sheet.triangles;
    for (const auto& [a, b, c] : front) sheet.triangles.push_back({a, c, b});
    EXPECT_EQ(SurfaceBorder(sheet).border_edges(), 40u);
}

TEST(SurfaceBorder, IsNotHiddenByATriangleWithoutArea) {
    Mesh square = shapes::plane(10, 1, 0);
    square.triangles.insert(square.triangles.begin(), {0, 1, 1});
    const SurfaceBorder border(square);
    EXPECT_EQ(border.border_edges(), 4u);
    EXPECT_TRUE(border.has(0, {0.5, 0.5, 0}));
}

TEST(IsOpen, TellsASheetFromAScanWithAHole) {
    EXPECT_TRUE(is_open(shapes::plane(100, 10, 0)));
    Mesh ball = shapes::sphere(100, 3);
    EXPECT_FALSE(is_open(ball));
    ball.triangles.pop_back();
    EXPECT_FALSE(is_open(ball)) << "3 of 768 edges";
    ball.triangles.resize(ball.triangles.size() / 2);
    EXPECT_TRUE(is_open(ball));
    EXPECT_FALSE(is_open({}));
}

}  // namespace
}  // namespace htvm
