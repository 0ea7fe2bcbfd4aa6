// The worst region of a surface.
#include "metrics/region_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// The triangles of the plane's squares within half a side of the middle, by their corners, are lifted.
Mesh lifted(Mesh plane, float middle, float half_side, float height) {
    for (auto& p : plane.positions)
        if (std::abs(p[0] - middle) <= half_side && std::abs(p[1] - middle) <= half_side) p[2] += height;
    return plane;
}

TEST(WorstRegion, OfASurfaceThatIsOffEverywhereIsOffByAsMuch) {
    const Mesh plane = shapes::plane(400, 20, 0);
    const auto error = worst_region(plane, shapes::moved(plane, 0, 0, 3));
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(error->worst_mm, 3, 1e-5);
    EXPECT_GT(error->regions, 20u);
}

TEST(WorstRegion, TellsOfOneLostPlaceWhatTheWholeDoesNot) {
    // 20 cm of 2 m are 12 mm away: regions of 10 cm lie wholly there, and the whole is 1.2 mm off.
    const Mesh plane = shapes::plane(2000, 100, 0);
    const auto error = worst_region(plane, lifted(plane, 1000, 100, 12));
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(error->worst_mm, 12, 0.05);
    EXPECT_LT(std::hypot(error->centre[0] - 1000, error->centre[1] - 1000), 100);
}

TEST(WorstRegion, HasTheMeanOfWhatIsSmallerThanIt) {
    // A plateau of 20 mm at 10 mm, with slopes of 10 mm around: the sum of squares over the area of a region around it.
    const Mesh plane = shapes::plane(400, 40, 0);
    const auto error = worst_region(plane, lifted(plane, 200, 10, 10));
    ASSERT_TRUE(error.has_value());
    const double area = std::numbers::pi * 50 * 50;
    EXPECT_GT(error->worst_mm, 0.8 * std::sqrt(20 * 20 * 10 * 10 / area));
    EXPECT_LT(error->worst_mm, 1.2 * std::sqrt(40 * 40 * 10 * 10 / area));
}

TEST(WorstRegion, SeesWhatIsMissingAndWhatIsTooMuch) {
    Mesh two = shapes::plane(200, 10, 0);
    const Mesh one = two, other = shapes::plane(200, 10, 80);
    const auto shift = static_cast<std::uint32_t>(two.positions.size());
    two.positions.insert(two.positions.end(), other.positions.begin(), other.positions.end());
    for (const auto& t : other.triangles) two.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    EXPECT_NEAR(worst_region(two, one)->worst_mm, 80, 1e-4);
    // As many of the samples nearest to a region are on the sheet that is too much as on the one that is right.
    EXPECT_NEAR(worst_region(one, two)->worst_mm, 80 * std::sqrt(0.5), 2);
}

TEST(WorstRegion, OfEqualMeshesIsZeroAndOfNothingToo) {
    const Mesh ball = shapes::sphere(100, 3);
    EXPECT_NEAR(worst_region(ball, ball)->worst_mm, 0, 1e-4);
    EXPECT_EQ(worst_region({}, ball)->regions, 0u);
    EXPECT_TRUE(std::isinf(worst_region(ball, {})->worst_mm));
}

TEST(WorstRegion, LeavesOutSpecks) {
    Mesh plane = shapes::plane(200, 10, 0);
    const Mesh without = plane;
    const auto v = static_cast<std::uint32_t>(plane.positions.size());
    plane.positions.insert(plane.positions.end(), {{0, 0, 500}, {20, 0, 500}, {0, 20, 500}});
    plane.triangles.push_back({v, v + 1, v + 2});
    EXPECT_NEAR(worst_region(plane, without)->worst_mm, 0, 1e-4);
}

TEST(RegionErrorSummary, HasPercentilesByNearestRank) {
    std::vector<double> worst;
    for (int i = 200; i > 0; --i) worst.push_back(i);
    const auto sums = summarise(worst);
    EXPECT_EQ(sums.frames, 200u);
    EXPECT_EQ(sums.median_mm, 100);
    EXPECT_EQ(sums.p99_mm, 198);
    EXPECT_EQ(sums.largest_mm, 200);
    EXPECT_EQ(summarise({7}).p99_mm, 7);
    EXPECT_EQ(summarise(std::vector<double>{}).frames, 0u);
}

}  // namespace
}  // namespace htvm
