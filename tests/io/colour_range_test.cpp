#include "io/colour_range.h"

#include <gtest/gtest.h>

#include <limits>

namespace htvm {
namespace {

ColourLevels levels_of(std::initializer_list<std::pair<double, int>> values) {
    ColourLevels out;
    for (const auto& [value, times] : values)
        for (int i = 0; i < times; ++i) out.count(value);
    return out;
}

TEST(ColourRange, IsThatOfTheMany) {
    EXPECT_EQ(colour_range_of(levels_of({{0.5, 2213}, {1.000001, 1}})), ColourRange::unit);
    EXPECT_EQ(colour_range_of(levels_of({{0.5, 95}, {40, 5}})), ColourRange::unit) << "a few lights too bright";
    EXPECT_EQ(colour_range_of(levels_of({{1, 100}, {200, 900}})), ColourRange::bytes) << "with dark places";
    EXPECT_EQ(colour_range_of(levels_of({{200, 950}, {1e9, 50}})), ColourRange::bytes) << "with damaged values";
    EXPECT_EQ(colour_range_of(levels_of({{200, 100}, {30000, 900}})), ColourRange::words);
}

TEST(ColourRange, IsTakenOverFramesTogether) {
    ColourLevels dark = levels_of({{1, 300}});
    EXPECT_EQ(colour_range_of(dark), ColourRange::unit) << "a nearly black frame alone says nothing else";
    dark += levels_of({{120, 3000}});
    EXPECT_EQ(colour_range_of(dark), ColourRange::bytes);
}

TEST(ColourRange, ZerosAndWhatIsNoNumberSayNothing) {
    const auto levels = levels_of({{0, 1000}, {-1, 10}, {std::numeric_limits<double>::quiet_NaN(), 10}});
    EXPECT_FALSE(levels.any());
    EXPECT_EQ(colour_range_of(levels), ColourRange::unit);
}

TEST(ColourLevel, IsRoundedAndClamped) {
    EXPECT_EQ(colour_level(0.5, ColourRange::unit), 128);
    EXPECT_EQ(colour_level(1.2, ColourRange::unit), 255);
    EXPECT_EQ(colour_level(254.6, ColourRange::bytes), 255);
    EXPECT_EQ(colour_level(65535, ColourRange::words), 255);
    EXPECT_EQ(colour_level(257, ColourRange::words), 1);
    EXPECT_EQ(colour_level(-3, ColourRange::bytes), 0);
    EXPECT_EQ(colour_level(std::numeric_limits<double>::quiet_NaN(), ColourRange::unit), 0);
}

}  // namespace
}  // namespace htvm
