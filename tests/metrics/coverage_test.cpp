// Coverage both ways, and the errors over what is covered.
#include "metrics/coverage.h"

#include <gtest/gtest.h>

#include <limits>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// A sheet as wide as `width` of 400 mm, 400 mm high.
Mesh sheet(double width) {
    Mesh mesh = shapes::plane(400, 80, 0);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return mesh.positions[t[0]][0] > width || mesh.positions[t[1]][0] > width || mesh.positions[t[2]][0] > width;
    });
    return mesh;
}

TEST(Coverage, OfTheSameSurfaceIsWhole) {
    const auto frame = coverage(sheet(400), sheet(400));
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(covered_share(frame->captured), 1);
    EXPECT_EQ(covered_share(frame->shown), 1);
    EXPECT_NEAR(frame->captured.area, 400 * 400, 1e-3);
    EXPECT_NEAR(covered_m2(*frame), 0, 1e-6);
}

TEST(Coverage, IsTheShareOfAreaWithinTheDistanceBothWays) {
    // What is shown lacks 100 of 400 mm, but for the 5 mm beside its border.
    const auto frame = coverage(sheet(400), sheet(300));
    ASSERT_TRUE(frame.has_value());
    EXPECT_NEAR(covered_share(frame->captured), 305.0 / 400, 0.005);
    EXPECT_NEAR(absent_share(frame->captured), 95.0 / 400, 0.005);
    EXPECT_EQ(covered_share(frame->shown), 1);
    CoverageOptions wider;
    wider.within = 50;
    EXPECT_NEAR(covered_share(coverage(sheet(400), sheet(300), wider)->captured), 350.0 / 400, 0.005);
}

TEST(Coverage, LeavesWhatIsMissingAndWhatIsTooMuchOutOfTheErrors) {
    const Mesh captured = sheet(400), shown = shapes::moved(sheet(200), 0, 0, 2);
    for (const auto& frame : {coverage(captured, shown), coverage(shown, captured)}) {
        ASSERT_TRUE(frame.has_value());
        EXPECT_NEAR(frame->captured.distances.rms, 2, 1e-5);
        EXPECT_NEAR(frame->shown.distances.rms, 2, 1e-5);
        EXPECT_NEAR(frame->captured.distances.largest, 2, 1e-5);
        EXPECT_NEAR(frame->region.worst_mm, 2, 1e-5);
    }
}

TEST(Coverage, CountsWhatIsElsewhereAmongTheErrors) {
    // A quarter is 20 mm off: not covered, but no coverage excuses it.
    const Mesh captured = sheet(400);
    Mesh shown = captured;
    for (auto& p : shown.positions)
        if (p[0] > 302) p[2] = 20;
    const auto frame = coverage(captured, shown);
    ASSERT_TRUE(frame.has_value());
    EXPECT_NEAR(covered_share(frame->captured), 0.75, 0.02);
    EXPECT_LT(absent_share(frame->captured), 0.01);
    EXPECT_NEAR(covered_m2(*frame), std::sqrt(0.25) * 20, 0.3);
    EXPECT_NEAR(frame->region.worst_mm, 20, 0.5);
    EXPECT_GT(frame->region.centre[0], 300);
}

TEST(Coverage, OfNothingIsNone) {
    const auto nothing_shown = coverage(sheet(400), {});
    ASSERT_TRUE(nothing_shown.has_value());
    EXPECT_EQ(covered_share(nothing_shown->captured), 0);
    EXPECT_EQ(absent_share(nothing_shown->captured), 1);
    EXPECT_EQ(covered_share(nothing_shown->shown), 1);
    EXPECT_FALSE(has_covered_errors(*nothing_shown));
    EXPECT_EQ(covered_share(coverage({}, sheet(400))->shown), 0);
}

TEST(Coverage, DoesNotSeeVerticesThatNoTriangleNames) {
    Mesh shown = sheet(400);
    shown.positions.push_back({1e6F, 0, 0});
    const auto frame = coverage(sheet(400), shown);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(covered_share(frame->shown), 1);
    EXPECT_NEAR(covered_m2(*frame), 0, 1e-6);
}

TEST(Coverage, OfSeveralFramesIsOfTheirAreaAndErrorsAreMeansOfThoseThatHaveSome) {
    CoverageSums sums;
    sums += *coverage(sheet(400), shapes::moved(sheet(400), 0, 0, 1));
    sums += *coverage(sheet(200), shapes::moved(sheet(200), 0, 0, 3));
    sums += *coverage(sheet(200), {});
    EXPECT_EQ(sums.frames, 3u);
    EXPECT_NEAR(covered_share(sums.captured), 600.0 / 800, 1e-3);
    EXPECT_EQ(sums.captured.least_covered, 0);
    EXPECT_EQ(sums.errors.frames, 2u);
    EXPECT_NEAR(m2(sums.errors), 2, 1e-5);
    EXPECT_NEAR(sums.errors.worst_frame_rms, 3, 1e-5);
}

TEST(Coverage, RefusesADistanceThatIsNone) {
    for (const double within : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
        CoverageOptions options;
        options.within = within;
        EXPECT_EQ(coverage(sheet(400), sheet(400), options).error().kind, ErrorKind::bad_input);
    }
}

}  // namespace
}  // namespace htvm
