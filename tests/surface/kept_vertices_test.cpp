// Which vertices of a mesh are those of another one, by connectivity alone. What they move:
// tracked_registration_test.cpp.
#include "surface/kept_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "surface/other_meshings.h"

namespace htvm::internal {
namespace {

constexpr auto none = OrientedPoints::no_point;

// A sheet of vertices at whole numbers, each with its number as the colour's three bytes; all its inner vertices have
// six triangles.
Mesh sheet(std::uint32_t side) {
    Mesh out;
    for (std::uint32_t v = 0; v < side * side; ++v) {
        out.positions.push_back({static_cast<float>(v % side), static_cast<float>(v / side), 0});
        out.colours.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v >> 8), 0});
    }
    for (std::uint32_t row = 0; row + 1 < side; ++row)
        for (std::uint32_t column = 0; column + 1 < side; ++column) {
            const std::uint32_t a = row * side + column;
            out.triangles.push_back({a, a + 1, a + side});
            out.triangles.push_back({a + 1, a + side + 1, a + side});
        }
    return out;
}

Mesh irregular_sheet(std::uint32_t side, std::uint32_t seed) {
    auto out = sheet(side);
    test::flip_edges(out, 4, seed);
    return out;
}

struct Known {
    double rightly = 0, wrongly = 0;  // shares of the vertices before
};
Known known_again(const Mesh& before, const Mesh& now) {
    const auto again = vertices_again(connectivity_around(before.positions.size(), before.triangles),
                                      connectivity_around(now.positions.size(), now.triangles));
    EXPECT_EQ(again.size(), before.positions.size());
    Known out;
    for (std::size_t v = 0; v < again.size(); ++v) {
        if (again[v] == none) continue;
        (before.colours[v] == now.colours[again[v]] ? out.rightly : out.wrongly) +=
            1.0 / static_cast<double>(again.size());
    }
    return out;
}

TEST(VerticesAgain, AreKnownHoweverTheyAreNumbered) {
    const auto before = irregular_sheet(60, 1);
    const auto known = known_again(before, test::renumbered(before, 1234));
    EXPECT_GT(known.rightly, 0.95);
    EXPECT_EQ(known.wrongly, 0);
}

TEST(VerticesAgain, AreKnownBesideAFewTrianglesThatHaveClosed) {
    const auto before = irregular_sheet(60, 1);
    auto now = before;
    for (std::uint32_t row = 7; row < 60; row += 15)
        for (std::uint32_t column = 7; column < 59; column += 15) {
            const std::uint32_t kept = row * 60 + column;
            for (auto& triangle : now.triangles) std::replace(triangle.begin(), triangle.end(), kept + 1, kept);
        }
    std::erase_if(now.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    const auto known = known_again(before, test::renumbered(now, 1234));
    EXPECT_GT(known.rightly, 0.7);
    EXPECT_LT(known.wrongly, 0.01);
}

TEST(VerticesAgain, AreFewWhereTheSurfaceIsMeshedAnew) {
    const auto known = known_again(irregular_sheet(60, 1), irregular_sheet(60, 2));
    EXPECT_LT(known.rightly + known.wrongly, 0.05);
}

TEST(VerticesAgain, AreEachItselfWhereAllAreInTheirOrderHoweverRegularTheMesh) {
    EXPECT_NEAR(known_again(sheet(20), sheet(20)).rightly, 1, 1e-9);
    EXPECT_LT(known_again(sheet(20), test::renumbered(sheet(20), 10)).rightly, 0.2);
}

TEST(VerticesAgain, AreNoneOfNothing) {
    EXPECT_TRUE(vertices_again({}, connectivity_around(2, {})).empty());
    EXPECT_EQ(vertices_again(connectivity_around(3, {}), {}), std::vector(3, none));
}

}  // namespace
}  // namespace htvm::internal
