// The extremities of a body, by distances along its surface.
#include "surface/limb_starts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

// Rows of places, 50 mm apart, that begin at a common one (place 0) in the given directions.
PlaceGraph star(const std::vector<std::pair<Vector3d, int>>& rows) {
    PlaceGraph out{{Vector3d::Zero()}, {{}}};
    for (const auto& [direction, places] : rows)
        for (std::uint32_t i = 1, before = 0; i <= static_cast<std::uint32_t>(places); ++i) {
            const auto here = static_cast<std::uint32_t>(out.places.size());
            out.places.emplace_back(50.0 * i * direction);
            out.beside.push_back({before});
            out.beside[before].push_back(here);
            before = here;
        }
    return out;
}

TEST(Extremities, AreTheEndsOfWhatStandsOut) {
    const auto graph = star({{{1, 0, 0}, 12}, {{-1, 0, 0}, 14}, {{0, 1, 0}, 9}});
    EXPECT_EQ(extremities(graph, LatticeUnits(250)), (std::vector<std::uint32_t>{12, 26, 35}));
}

TEST(Extremities, AreFoundWhereTheEndsOfTwoLimbsNearlyTouch) {
    // Two limbs side by side, as arms that are held out together.
    const double angle = 0.02;
    const auto graph = star({{{1, 0, 0}, 12}, {{std::cos(angle), std::sin(angle), 0}, 12}, {{-1, 0, 0}, 12}});
    EXPECT_EQ(extremities(graph, LatticeUnits(250)), (std::vector<std::uint32_t>{12, 24, 36}));
}

TEST(Extremities, AreNotWhatStandsOutLessThanTheirDistance) {
    const auto graph = star({{{1, 0, 0}, 12}, {{-1, 0, 0}, 12}, {{0, 1, 0}, 1}});
    EXPECT_EQ(extremities(graph, LatticeUnits(250)), (std::vector<std::uint32_t>{12, 24}));
    EXPECT_TRUE(extremities({}, LatticeUnits(250)).empty());
    EXPECT_TRUE(extremities(star({}), LatticeUnits(250)).empty());
}

TEST(GraphOfSurface, KeepsPartsThatOnlyPassNearEachOtherApart) {
    // Two strips of squares of 10 mm, one above the other in the same cubes.
    std::vector<Point3f> points;
    std::vector<Triangle> triangles;
    for (const float height : {3.0F, 9.0F}) {
        const auto first = static_cast<std::uint32_t>(points.size());
        for (std::uint32_t i = 0; i <= 40; ++i)
            for (const float y : {5.0F, 15.0F}) points.push_back({static_cast<float>(10 * i) + 1, y, height});
        for (std::uint32_t i = first; i < first + 80; i += 2) {
            triangles.push_back({i, i + 2, i + 1});
            triangles.push_back({i + 1, i + 2, i + 3});
        }
    }
    const auto graph = graph_of_surface(SurfaceIndex(points, triangles), LatticeUnits(40));
    ASSERT_EQ(graph.places.size(), 22u);  // 401 mm, twice
    for (std::size_t place = 0; place < graph.places.size(); ++place)
        for (const auto other : graph.beside[place]) {
            EXPECT_NEAR(graph.places[place].z(), graph.places[other].z(), 1e-3);
            EXPECT_LT((graph.places[place] - graph.places[other]).norm(), 60);
        }
    EXPECT_EQ(extremities(graph, LatticeUnits(250)).size(), 4u);
}

}  // namespace
}  // namespace htvm::internal
