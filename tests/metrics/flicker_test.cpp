#include "metrics/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "metrics/shapes.h"

namespace htvm {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

FlickerOptions small_pictures() {
    FlickerOptions options;
    options.views = {.views = 1, .width = 80, .height = 64, .orthographic = true};
    return options;
}

Mesh square(int level) {
    Mesh mesh = shapes::plane(100, 2, 0);
    const auto grey = static_cast<std::uint8_t>(level);
    mesh.colours.assign(mesh.positions.size(), {grey, grey, grey});
    return mesh;
}

// From the first pair to the second.
FrameFlicker flicker(const Mesh& original_0, const Mesh& decoded_0, const Mesh& original_1, const Mesh& decoded_1) {
    FlickerMeter meter(small_pictures());
    const auto first = meter.add(original_0, decoded_0);
    EXPECT_TRUE(first && !*first) << "nothing is before the first frame";
    const auto second = meter.add(original_1, decoded_1);
    EXPECT_TRUE(second && *second);
    return **second;
}

TEST(Flicker, OfADecodedSequenceThatIsItsOriginalIsOne) {
    const auto change = flicker(square(100), square(100), square(130), square(130)).unlit;
    EXPECT_DOUBLE_EQ(original_change(change), 30);
    EXPECT_DOUBLE_EQ(decoded_change(change), 30);
    EXPECT_EQ(flicker_ratio(change), 1);
}

TEST(Flicker, IsTheChangeOfTheDecodedPicturesOverThatOfTheOriginals) {
    const auto change = flicker(square(100), square(95), square(110), square(120)).unlit;
    EXPECT_DOUBLE_EQ(original_change(change), 10);
    EXPECT_DOUBLE_EQ(decoded_change(change), 25);
    EXPECT_DOUBLE_EQ(flicker_ratio(change), 2.5);
}

TEST(Flicker, OfAnErrorThatStaysIsNone) {
    EXPECT_EQ(flicker_ratio(flicker(square(100), square(90), square(110), square(100)).unlit), 1);
}

TEST(Flicker, StillPixelsAreThoseWhereTheOriginalHardlyChanges) {
    Mesh half = square(100);  // brighter on the right
    for (std::size_t v = 0; v < half.positions.size(); ++v)
        if (half.positions[v][0] > 75) half.colours[v] = {180, 180, 180};
    const auto change = flicker(square(100), square(100), half, square(106)).unlit;
    EXPECT_GT(change.still_pixels, change.pixels / 2);
    EXPECT_LT(change.still_pixels, change.pixels * 2 / 3);
    EXPECT_DOUBLE_EQ(still_change(change), 6);
    EXPECT_EQ(flicker(square(100), square(100), square(108), square(100)).unlit.still_pixels, change.pixels);
    EXPECT_EQ(flicker(square(100), square(100), square(109), square(100)).unlit.still_pixels, 0u);
}

TEST(Flicker, PixelsThatOneFrameAloneCoversAreNotStill) {
    Mesh white = square(255);  // as the background
    const auto change = flicker(white, white, shapes::moved(white, 30, 0, 0), white).unlit;
    EXPECT_EQ(change.original, 0u);
    EXPECT_LT(change.still_pixels, change.pixels);
}

TEST(Flicker, WhereTheOriginalStandsStillIsWithoutBound) {
    EXPECT_TRUE(std::isinf(flicker_ratio(flicker(square(100), square(100), square(100), square(101)).unlit)));
    EXPECT_EQ(flicker_ratio(flicker(square(100), square(90), square(100), square(90)).unlit), 1);
}

TEST(Flicker, MotionAlikeInBothSequencesIsNone) {
    const Mesh moved = shapes::moved(square(100), 7, 3, 0);
    const auto change = flicker(square(100), square(100), moved, moved);
    EXPECT_GT(original_change(change.unlit), 1);
    EXPECT_EQ(flicker_ratio(change.unlit), 1);
    EXPECT_EQ(flicker_ratio(change.lit), 1);
}

TEST(Flicker, OfTheShapeShowsInLitPicturesAlone) {
    // Tilted as seen from the side of z: as large as before in an orthographic picture of its middle.
    Mesh bent = square(100);
    for (auto& p : bent.positions) p[2] = 0.5f * p[0];
    const auto change = flicker(square(100), square(100), square(100), bent);
    EXPECT_GT(decoded_change(change.lit), 1);
    EXPECT_EQ(decoded_change(change.unlit), 0);
}

TEST(Flicker, WithoutColoursHasNoUnlitPictures) {
    const Mesh plain = shapes::plane(100, 2, 0);
    const auto change = flicker(square(100), square(100), square(100), plain);
    EXPECT_GT(change.lit.pixels, 100u);
    EXPECT_EQ(change.unlit.pixels, 0u);
}

TEST(Flicker, IsNotMeasuredAcrossAGap) {
    FlickerMeter meter(small_pictures());
    ASSERT_TRUE(meter.add(square(100), square(100)));
    meter.begin_anew();
    const auto second = meter.add(square(110), square(110));
    EXPECT_TRUE(second && !*second);
}

TEST(Flicker, RefusesMeshesThatCannotBeMeasured) {
    Mesh bad = square(1);
    bad.positions[0][0] = std::numeric_limits<float>::infinity();
    FlickerMeter meter(small_pictures());
    EXPECT_EQ(meter.add(square(1), bad).error().kind, ErrorKind::bad_input);
    EXPECT_EQ(meter.add(bad, square(1)).error().kind, ErrorKind::bad_input);
}

constexpr auto I = FrameType::intra, T = FrameType::tracked, TP = FrameType::patched;

TEST(FlickerBesideTracked, IsARatioOverTheMedianOfTheNearestTwoTFramesOnEachSide) {
    const std::vector<FrameType> kinds{I, T, T, T, TP, T, T, T};
    const std::vector<double> ratios{nan, 9, 1, 2, 4, 3, 1, 9};
    EXPECT_DOUBLE_EQ(*flicker_beside_tracked(kinds, ratios, 4), 4 / 1.5);
}

TEST(FlickerBesideTracked, PassesOverOtherKindsAndFramesWithoutARatio) {
    const std::vector<FrameType> kinds{T, T, TP, I, T, T};
    const std::vector<double> ratios{nan, 2, 7, 3, nan, 4};
    EXPECT_DOUBLE_EQ(*flicker_beside_tracked(kinds, ratios, 3), 1);
    EXPECT_DOUBLE_EQ(*flicker_beside_tracked(kinds, ratios, 2), 7.0 / 3);
    EXPECT_FALSE(flicker_beside_tracked(kinds, ratios, 0));
}

TEST(FlickerBesideTracked, IsNothingWithoutATFrameWithinSixFrames) {
    std::vector<FrameType> kinds(9, TP);
    const std::vector<double> ratios(9, 1.0);
    EXPECT_FALSE(flicker_beside_tracked(kinds, ratios, 0));
    kinds[7] = T;
    EXPECT_FALSE(flicker_beside_tracked(kinds, ratios, 0));
    EXPECT_TRUE(flicker_beside_tracked(kinds, ratios, 1));
}

}  // namespace
}  // namespace htvm
