// What comes and goes between frames.
#include "metrics/presence_change.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// The strip of a sheet of 400 by 400 mm between these x.
Mesh strip(float from, float to, float height = 0) {
    Mesh mesh = shapes::plane(400, 80, height);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::ranges::any_of(t, [&](auto v) { return mesh.positions[v][0] < from || mesh.positions[v][0] > to; });
    });
    return mesh;
}

TEST(PresenceMeter, HasNothingToSayOfTheFirstFrameNorBehindAGap) {
    PresenceMeter meter;
    EXPECT_FALSE(meter.add(strip(0, 400), strip(0, 400))->has_value());
    EXPECT_TRUE(meter.add(strip(0, 400), strip(0, 400))->has_value());
    meter.begin_anew();
    EXPECT_FALSE(meter.add(strip(0, 400), strip(0, 400))->has_value());
}

TEST(PresenceMeter, CountsWhatAppearsAndWhatVanishesBeyondTheDistance) {
    PresenceMeter meter;
    (void)meter.add(strip(0, 300), strip(0, 300));
    // The capture's border goes out by 40 mm; what is shown keeps its own.
    const auto out = meter.add(strip(0, 340), strip(0, 300));
    ASSERT_TRUE(out.has_value() && out->has_value());
    EXPECT_NEAR((*out)->captured.appeared, 35 * 400, 400);
    EXPECT_EQ((*out)->captured.vanished, 0);
    EXPECT_NEAR(changed_share((*out)->captured), 35.0 / 340, 0.005);
    EXPECT_EQ(changed_share((*out)->shown), 0);
    EXPECT_NEAR(covered_before_share((*out)->captured), 305.0 / 340, 0.005);
    const auto back = meter.add(strip(0, 300), strip(0, 300));
    EXPECT_NEAR((*back)->captured.vanished, 35 * 400, 400);
    EXPECT_EQ((*back)->captured.appeared, 0);
}

TEST(PresenceMeter, SeesAHoleThatFlickers) {
    Mesh holey = strip(0, 400);
    std::erase_if(holey.triangles, [&](const Triangle& t) {
        const auto& p = holey.positions[t[0]];
        return p[0] > 100 && p[0] < 200 && p[1] > 100 && p[1] < 200;
    });
    PresenceMeter meter;
    (void)meter.add(strip(0, 400), strip(0, 400));
    const auto change = meter.add(strip(0, 400), holey);
    EXPECT_GT((*change)->shown.vanished, 80 * 80);
    EXPECT_EQ((*change)->shown.appeared, 0);
}

TEST(PresenceMeter, TakesMotionAcrossASurfaceForMotion) {
    PresenceMeter meter;
    (void)meter.add(strip(0, 400), strip(0, 400));
    const auto change = meter.add(strip(0, 400, 30), strip(0, 400, 30));
    EXPECT_EQ(changed_share((*change)->captured), 0);
    EXPECT_EQ(covered_before_share((*change)->captured), 0) << "though the frame before covers nothing of it";
}

TEST(PresenceMeter, DoesNotMindOtherVerticesOfTheSameSurface) {
    PresenceMeter meter;
    const Mesh coarse = shapes::plane(400, 7, 0), fine = shapes::plane(400, 90, 0);
    (void)meter.add(coarse, fine);
    const auto change = meter.add(fine, coarse);
    EXPECT_EQ(changed_share((*change)->captured), 0);
    EXPECT_EQ(changed_share((*change)->shown), 0);
}

TEST(PresenceMeter, RefusesAMeshThatCannotBeMeasured) {
    Mesh bad = strip(0, 400);
    bad.triangles[0][0] = 1000000;
    PresenceMeter meter;
    EXPECT_EQ(meter.add(bad, strip(0, 400)).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm
