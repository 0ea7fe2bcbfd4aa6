#include "codec/encoder/control/rate_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "codec/encoder/control/rate_plan.h"
#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

// A capture whose frame sizes follow log2(bits) = level + slope * quality, with noise of +-10 %.
struct Capture {
    double enhanced_bits = 200e3;  // at quality 50
    double intra_times = 2.5;
    double slope = 0.04;
    int jump_at = -1;  // from here on, the content takes twice the bits
    int forced_percent = 0;
    int predicted_percent = 0;
    int frames = 300;
    int key_interval = 30;
};

struct Outcome {
    double bits = 0, fullest = 0;  // total; the buffer's highest level relative to its capacity
    double steepest = 0;           // largest quality change between consecutive EP-frames after the 60th frame
    double lowest = 1000, highest = -1000;
    double intra_apart = 0;  // largest difference between an I-frame's quality and that of the EP-frame before it,
                             // after the 60th frame
    int most_calls = 0;
};

double size_of(const Capture& c, int frame, FrameType type, double quality, double noise) {
    if (type == FrameType::predicted) return 3000;
    const double content = c.jump_at >= 0 && frame >= c.jump_at ? 2 : 1;
    return c.enhanced_bits * content * (type == FrameType::intra ? c.intra_times : 1) *
           std::exp2(c.slope * (quality - 50)) * noise;
}

std::vector<FrameType> types_of(const Capture& c, std::mt19937& random) {
    std::vector<FrameType> types;
    for (int f = 0; f < c.frames; ++f) {
        const bool forced = test::between(random, 0, 99) < c.forced_percent;
        const bool predicted = test::between(random, 0, 99) < c.predicted_percent;
        types.push_back(forced || f % c.key_interval == 0 ? FrameType::intra
                        : predicted                       ? FrameType::predicted
                                                          : FrameType::enhanced);
    }
    return types;
}

Outcome code(const Capture& c, const RateControlOptions& options, std::vector<FrameCost> first_pass = {}) {
    std::mt19937 random(7), type_random(3);
    const auto types = types_of(c, type_random);
    RateController rate(options, std::move(first_pass));
    Outcome run;
    double last = -1;
    const double capacity = options.bits_per_second * options.buffer_seconds;
    for (int f = 0; f < c.frames; ++f) {
        auto type = types[static_cast<std::size_t>(f)];
        const double noise = 0.9 + 0.2 * test::between(random, 0, 1000) / 1000;
        double quality = rate.quality(type), bits = size_of(c, f, type, quality, noise);
        int calls = 0;
        while (bits > rate.room() && quality > options.lowest_quality) {
            const double lower = rate.lower_quality(type, quality, bits);
            EXPECT_LT(lower, quality);
            quality = lower, bits = size_of(c, f, type, quality, noise), ++calls;
        }
        if (bits > rate.room()) type = FrameType::predicted, bits = 0;
        run.most_calls = std::max(run.most_calls, calls);
        run.fullest = std::max(run.fullest, (capacity - rate.room() + bits) / capacity);
        if (f >= 60 && type == FrameType::enhanced) run.steepest = std::max(run.steepest, std::abs(quality - last));
        if (f >= 60 && type == FrameType::intra) run.intra_apart = std::max(run.intra_apart, std::abs(quality - last));
        if (type == FrameType::enhanced) last = quality;
        run.lowest = std::min(run.lowest, quality), run.highest = std::max(run.highest, quality);
        run.bits += bits;
        rate.coded({type, quality, bits});
    }
    return run;
}

double target_of(const Capture& c, const RateControlOptions& options) {
    return options.bits_per_second / options.frames_per_second * c.frames;
}

// What a first pass at quality 50 finds; its noise differs from that of the second pass.
std::vector<FrameCost> first_pass_of(const Capture& c) {
    std::mt19937 random(11), type_random(3);
    std::vector<FrameCost> costs;
    const auto types = types_of(c, type_random);
    for (int f = 0; f < c.frames; ++f) {
        const double noise = 0.9 + 0.2 * test::between(random, 0, 1000) / 1000;
        const auto type = types[static_cast<std::size_t>(f)];
        costs.push_back({type, 50, size_of(c, f, type, 50, noise)});
    }
    return costs;
}

void expect_on_target(const Capture& c, const RateControlOptions& options) {
    const Outcome run = code(c, options);
    EXPECT_NEAR(run.bits / target_of(c, options), 1, 0.05);
    EXPECT_LE(run.fullest, 1);
    EXPECT_LE(run.most_calls, 5);
}

TEST(RateControl, ThreeHundredFramesLandWithinFivePercent) {
    for (const double slope : {0.02, 0.03, 0.04, 0.06, 0.08})
        for (const double rate : {4e6, 6e6, 1.2e7})
            for (const double buffer : {0.3, 0.5, 1.0, 3.0}) {
                SCOPED_TRACE(testing::Message() << "slope " << slope << " rate " << rate << " buffer " << buffer);
                expect_on_target({.slope = slope}, {.bits_per_second = rate, .buffer_seconds = buffer});
            }
}

TEST(RateControl, AJumpThatDoublesTheBitsIsSteeredAway) {
    for (const double slope : {0.03, 0.04, 0.06})
        for (const double buffer : {0.5, 1.0})
            expect_on_target({.slope = slope, .jump_at = 150}, {.buffer_seconds = buffer});
}

TEST(RateControl, ForcedIntraFramesAreAbsorbed) {
    expect_on_target({.intra_times = 3, .forced_percent = 5}, {});
    expect_on_target({.intra_times = 3, .forced_percent = 20}, {});
}

TEST(RateControl, PredictedFramesLeaveTheirBitsToTheOthers) { expect_on_target({.predicted_percent = 30}, {}); }

TEST(RateControl, IntraFramesAloneAreOnTargetToo) {
    expect_on_target({.key_interval = 1}, {.key_interval = 1});
    expect_on_target({.key_interval = 1}, {.key_interval = 30});
}

TEST(RateControl, QualityIsSmoothInSteadyState) {
    for (const double slope : {0.03, 0.04, 0.06}) {
        const Outcome run = code({.slope = slope}, {});
        EXPECT_LE(run.steepest, 2);
        EXPECT_LE(run.intra_apart, 2);
    }
}

TEST(RateControl, ATargetAboveWhatTheHighestQualityNeedsIsNotReached) {
    const Capture capture;
    const RateControlOptions options{.bits_per_second = 1e9};
    const Outcome run = code(capture, options);
    EXPECT_LT(run.bits, target_of(capture, options));
    EXPECT_EQ(run.highest, 100);
}

TEST(RateControl, ATargetBelowWhatTheLowestQualityNeedsNeverOverfillsTheBuffer) {
    for (const double rate : {1e3, 1e5, 5e5, 1e6}) {
        const Outcome run = code({}, {.bits_per_second = rate});
        EXPECT_LE(run.fullest, 1) << rate;
        EXPECT_LE(run.most_calls, 5) << rate;
    }
}

TEST(RateControl, TheFifthLowerQualityIsTheLowest) {
    RateController rate({.bits_per_second = 1000});
    double quality = 100;
    for (int i = 0; i < 5; ++i) quality = rate.lower_quality(FrameType::intra, quality, rate.room() * 1.0001);
    EXPECT_EQ(quality, 0);
}

TEST(RateControl, RoomIsWhatTheBufferDoesNotHold) {
    RateController rate({.bits_per_second = 3000, .frames_per_second = 30, .buffer_seconds = 2});
    EXPECT_EQ(rate.room(), 6000);
    rate.coded({FrameType::intra, 50, 5000});
    EXPECT_EQ(rate.room(), 1100);
    for (int i = 0; i < 60; ++i) rate.coded({FrameType::predicted, 50, 0});
    EXPECT_EQ(rate.room(), 6000);
}

TEST(RateControl, AFirstPassBringsTheTotalWithinTwoPercent) {
    for (const double slope : {0.03, 0.04, 0.055})
        for (const double rate : {4e6, 8e6})
            for (const int jump : {-1, 150}) {
                SCOPED_TRACE(testing::Message() << "slope " << slope << " rate " << rate << " jump " << jump);
                const Capture capture{.slope = slope, .jump_at = jump};
                const RateControlOptions options{.bits_per_second = rate, .buffer_seconds = 2};
                const Outcome run = code(capture, options, first_pass_of(capture));
                EXPECT_NEAR(run.bits / target_of(capture, options), 1, 0.02);
                EXPECT_LE(run.fullest, 1);
                EXPECT_LE(run.steepest, jump < 0 ? 2 : 30);
            }
}

TEST(RateControl, AnIntraFrameThatComesEarlyNearTheEndIsMadeUpFor) {
    const Capture capture{.intra_times = 8, .frames = 100};
    const RateControlOptions options{.buffer_seconds = 2};
    RateController rate(options, first_pass_of(capture));  // with I-frames at 0, 30, 60 and 90
    double bits = 0;
    for (int f = 0; f < capture.frames; ++f) {
        const bool intra = f == 88 || (f % 30 == 0 && f != 90);
        const auto type = intra ? FrameType::intra : FrameType::enhanced;
        const double quality = rate.quality(type), own = size_of(capture, f, type, quality, 1);
        rate.coded({type, quality, own});
        bits += own;
    }
    EXPECT_NEAR(bits / target_of(capture, options), 1, 0.02);
}

TEST(RatePlan, IsOneQualityWhereTheBufferAllows) {
    const auto costs = first_pass_of({});
    const auto plan = plan_qualities(costs, {}, 0.04);
    double bits = 0;
    for (std::size_t i = 0; i < plan.size(); ++i) bits += bits_at(costs[i], plan[i], 0.04);
    EXPECT_EQ(*std::min_element(plan.begin(), plan.end()), *std::max_element(plan.begin(), plan.end()));
    EXPECT_NEAR(bits, 8e6 / 30 * 300, 1e3);
}

TEST(RatePlan, LowersOnlyWhatOverfillsTheBuffer) {
    const auto costs = first_pass_of({.jump_at = 150});
    const RateControlOptions options{.buffer_seconds = 0.5};
    const auto plan = plan_qualities(costs, options, 0.04);
    EXPECT_GT(plan.front(), plan.back());
    double buffer = 0;
    for (std::size_t i = 0; i < plan.size(); ++i) {
        buffer += bits_at(costs[i], plan[i], 0.04);
        EXPECT_LE(buffer, 0.91 * 8e6 * 0.5);
        buffer = std::max(0.0, buffer - 8e6 / 30);
    }
}

TEST(RatePlan, OfNoFramesIsEmpty) { EXPECT_TRUE(plan_qualities({}, {}, 0.04).empty()); }

// The average size of the frames from `first` on, in units of what the line carries at the new rate.
double after_change(double before, double after, int first, int frames) {
    Capture capture;
    capture.key_interval = 1000;
    RateControlOptions options;
    options.bits_per_second = before;
    options.key_interval = 30;
    RateController rate(options);
    constexpr int change_at = 90;
    double bits = 0;
    for (int f = 0; f < change_at + first + frames; ++f) {
        if (f == change_at) rate.change_rate(after);
        const auto type = f == 0 ? FrameType::intra : FrameType::enhanced;
        const double quality = rate.quality(type), size = size_of(capture, f, type, quality, 1);
        if (f >= change_at + first) bits += size;
        rate.coded({type, quality, size});
    }
    return bits / frames / (after / options.frames_per_second);
}

TEST(RateControl, FollowsARateThatIsChangedWithinHalfASecond) {
    for (const auto& [before, after] : {std::pair{8e6, 4e6}, {8e6, 2e6}, {2e6, 8e6}, {4e6, 5e6}})
        EXPECT_NEAR(after_change(before, after, 15, 15), 1, 0.2) << before << " to " << after;
}

TEST(RateControl, KeepsToTheBufferOfTheChangedRateFromTheFirstFrameOn) {
    RateControlOptions options;
    options.bits_per_second = 8e6;
    RateController rate(options);
    rate.coded({FrameType::intra, 50, 7e6});
    rate.change_rate(2e6);
    EXPECT_EQ(rate.room(), 1e6) << "half of a second at 2 Mbit/s";
    rate.change_rate(0);
    rate.change_rate(-1);
    EXPECT_EQ(rate.room(), 1e6) << "no rate changes nothing";
}

TEST(RateControl, DropsThePlanOfAFirstPassWhenTheRateChanges) {
    RateControlOptions options;
    options.bits_per_second = 8e6;
    const std::vector<FrameCost> first_pass(100, {FrameType::enhanced, 50, 270e3});
    RateController rate(options, first_pass);
    const double planned = rate.quality(FrameType::enhanced);
    rate.change_rate(2e6);
    EXPECT_NEAR(rate.quality(FrameType::enhanced), planned - 2 / 0.04, 12);
}

}  // namespace
}  // namespace htvm::internal
