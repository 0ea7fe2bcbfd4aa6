// When a bitrate counts as missed, at the end of an encode.
#include "rate_report.h"

#include <gtest/gtest.h>

namespace htvm::app {
namespace {

RateReport of_a_megabit() {
    EncoderOptions options;
    options.rate.bits_per_second = 1e6;
    return RateReport(options);
}

std::string missed(const RateReport& report, double megabits) {
    constexpr double seconds = 2;
    return missed_rate(report, static_cast<std::uint64_t>(megabits * 1e6 / 8 * seconds), seconds);
}

TEST(MissedRate, OfMeshesAloneIsOneAThirdAbove) {
    const auto report = of_a_megabit();
    EXPECT_EQ(missed(report, 1.3), "");
    EXPECT_EQ(missed(report, 0.1), "");
    EXPECT_EQ(missed(report, 1.4),
              "takes 1.40 Mbit/s, 40 % above its --bitrate: give at least that, or fewer vertices");
}

TEST(MissedRate, OfMeshesAndPicturesIsFivePercentEitherWay) {
    auto report = of_a_megabit();
    report.is_shared = true;
    EXPECT_EQ(missed(report, 1.04), "");
    EXPECT_EQ(missed(report, 0.96), "");
    EXPECT_EQ(missed(report, 1.06),
              "takes 1.06 Mbit/s, 6 % above its --bitrate: give at least that, or fewer vertices");
    EXPECT_EQ(
        missed(report, 0.9),
        "takes 0.90 Mbit/s, 10 % below its --bitrate, which its meshes and pictures did not find how to use: give "
        "-q in its place, or a larger --buffer");
}

TEST(MissedRate, LessIsNoFaultWhereAllIsAtItsFinest) {
    auto report = of_a_megabit();
    report.is_shared = report.is_finest = true;
    EXPECT_EQ(missed(report, 0.5), "");
}

}  // namespace
}  // namespace htvm::app
