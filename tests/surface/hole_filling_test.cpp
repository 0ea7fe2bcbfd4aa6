// Small holes of a captured surface are closed.
#include "surface/hole_filling.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/geometry.h"
#include "surface/open_border.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

constexpr std::uint32_t side = 9, middle = 4 * side + 4;

bool names(const Triangle& t, std::uint32_t v) { return std::ranges::find(t, v) != t.end(); }

// Seen from above; without the six triangles around its middle.
LatticeMesh grid_with_hole() {
    LatticeMesh out;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            out.positions.push_back({static_cast<std::int32_t>(40 * x), static_cast<std::int32_t>(40 * y), 0});
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t v = y * side + x;
            out.triangles.push_back({v, v + 1, v + side});
            out.triangles.push_back({v + 1, v + side + 1, v + side});
        }
    std::erase_if(out.triangles, [](const Triangle& t) { return names(t, middle); });
    return out;
}
// The hole's rim, and from where on it is filled: around it are two sides of each direction.
const std::vector<std::uint32_t> rim = {middle - side, middle - side + 1, middle + 1,
                                        middle + side, middle + side - 1, middle - 1};

TEST(HoleFilling, ClosesASmallHoleByTrianglesAroundItsMiddle) {
    auto mesh = grid_with_hole();
    const auto before = mesh;
    EXPECT_EQ(fill_small_holes(mesh, {}), 1u);
    ASSERT_EQ(mesh.positions.size(), before.positions.size() + 1);
    EXPECT_EQ(mesh.positions.back(), before.positions[middle]);
    ASSERT_EQ(mesh.triangles.size(), before.triangles.size() + rim.size());
    const auto centre = static_cast<std::uint32_t>(before.positions.size());
    for (std::size_t t = before.triangles.size(); t < mesh.triangles.size(); ++t) {
        EXPECT_TRUE(names(mesh.triangles[t], centre));
        EXPECT_GT(area_vector(std::span<const LatticePoint>(mesh.positions), mesh.triangles[t])[2], 0) << "faces down";
    }
    const auto edges = edges_from_border(points_of(mesh.positions), mesh.triangles);
    for (const auto v : rim) EXPECT_EQ(edges[v], far_from_border);
}

TEST(HoleFilling, GivesTheMiddleTheMeanColourOfTheRim) {
    auto mesh = grid_with_hole();
    mesh.colours.assign(mesh.positions.size(), {10, 20, 30});
    for (std::size_t i = 0; i < 3; ++i) mesh.colours[rim[i]] = {40, 20, 0};
    ASSERT_EQ(fill_small_holes(mesh, {}), 1u);
    ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
    EXPECT_EQ(mesh.colours.back(), (Colour{25, 20, 15}));
}

TEST(HoleFilling, LeavesTheBorderAroundThePartHoweverLongAHoleMayBe) {
    auto mesh = grid_with_hole();
    HoleFillingOptions options;
    options.longest = LatticeUnits(1e6);
    EXPECT_EQ(fill_small_holes(mesh, options), 1u);
    EXPECT_EQ(edges_from_border(points_of(mesh.positions), mesh.triangles)[0], 0);
    EXPECT_EQ(fill_small_holes(mesh, options), 0u) << "it is closed now";
}

TEST(HoleFilling, LeavesAHoleWithALongerRimOrMoreSides) {
    auto mesh = grid_with_hole();
    HoleFillingOptions options;
    options.longest = LatticeUnits(200);  // of 4 sides of 40 and 2 across
    EXPECT_EQ(fill_small_holes(mesh, options), 0u);
    options = {};
    options.most_sides = 5;
    EXPECT_EQ(fill_small_holes(mesh, options), 0u);
    options.most_sides = 6;
    EXPECT_EQ(fill_small_holes(mesh, options), 1u);
}

TEST(HoleFilling, LeavesAHoleWhoseRimIsFarFromAnyPlane) {
    auto mesh = grid_with_hole();
    for (std::size_t i = 0; i < rim.size(); i += 2) mesh.positions[rim[i]].z = 400;
    const auto before = mesh.triangles;
    EXPECT_EQ(fill_small_holes(mesh, {}), 0u);
    EXPECT_EQ(mesh.triangles, before);
}

}  // namespace
}  // namespace htvm::internal
