#include "core/srgb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace htvm::internal {
namespace {

TEST(Srgb, EveryLevelComesBackFromItsLight) {
    for (int level = 0; level < 256; ++level) EXPECT_EQ(level_of(light_of(static_cast<std::uint8_t>(level))), level);
}

TEST(Srgb, ALevelIsTheNearestOne) {
    for (int i = 0; i <= 100000; ++i) {
        const double light = i / 100000.0;
        const double share = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
        EXPECT_NEAR(level_of(static_cast<float>(light)), 255 * share, 0.501) << light;
    }
}

TEST(Srgb, HalfOfTheLightIsLevel188) {
    EXPECT_EQ(level_of(0.5f), 188);
    EXPECT_NEAR(light_of(188), 0.5, 0.003);
}

TEST(Srgb, LightOutOfRangeIsBlackOrWhite) {
    EXPECT_EQ(level_of(-1), 0);
    EXPECT_EQ(level_of(2), 255);
    EXPECT_EQ(level_of(std::numeric_limits<float>::infinity()), 255);
    EXPECT_EQ(level_of(std::numeric_limits<float>::quiet_NaN()), 0);
}

}  // namespace
}  // namespace htvm::internal
