// What the next pass is told to expect lies between the passes around the wanted rate.
#include "rate_passes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace htvm::app {
namespace {

std::vector<FrameCost> costs(double quality, double bits) {
    return {{FrameType::intra, quality, 3 * bits}, {FrameType::tracked, quality, bits}};
}

TEST(RatePasses, ExpectWhatTheLastTookAsLongAsAllTookTooMuch) {
    RatePasses passes(100);
    passes.add(costs(50, 100));
    passes.add(costs(40, 50));
    EXPECT_EQ(passes.expected()[0].bits, 150);
    EXPECT_EQ(passes.expected()[0].quality, 40);
}

TEST(RatePasses, ExpectTheWantedBitsBetweenTheNearestPasses) {
    RatePasses passes(400);
    for (const auto& [quality, bits] : {std::pair{90.0, 1000.0}, {60.0, 200.0}, {40.0, 50.0}, {10.0, 10.0}})
        passes.add(costs(quality, bits));
    const auto expected = passes.expected();
    EXPECT_NEAR(expected[0].bits + expected[1].bits, 400, 0.01);
    EXPECT_NEAR(expected[0].bits, 300, 0.01);
    EXPECT_NEAR(expected[0].quality, 50, 1e-6) << "100 is half way from 50 to 200 on a scale of logarithms";
    EXPECT_EQ(expected[1].type, FrameType::tracked);
}

TEST(RatePasses, LeaveDroppedFramesAsTheyWere) {
    RatePasses passes(100);
    passes.add({{FrameType::intra, 20, 50}, {FrameType::predicted, 0, 0}});
    passes.add({{FrameType::intra, 40, 200}, {FrameType::tracked, 40, 50}});
    EXPECT_NEAR(passes.expected()[0].bits, 100, 0.01);
    EXPECT_EQ(passes.expected()[1].bits, 0);
}

}  // namespace
}  // namespace htvm::app
