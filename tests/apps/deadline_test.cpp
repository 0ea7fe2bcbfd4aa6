// How much is searched for frames that have a deadline.
#include "deadline.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace htvm::app {
namespace {

// A machine on which a frame takes `usual` milliseconds at effort 5, half of that as motion alone, and every effort in
// between accordingly; meshes come every 33 ms.
double took(int effort, double usual) { return effort == 0 ? 0.5 * usual : usual * (0.7 + 0.06 * effort); }

Deadline after(std::size_t frames, double usual, double milliseconds, int most = 5) {
    Deadline deadline(milliseconds, most);
    double waited = 0;
    for (std::size_t i = 0; i < frames; ++i) {
        TimedFrame frame{deadline.effort(waited), waited, 0};
        frame.took = took(frame.effort, usual);
        deadline.took(frame);
        waited = std::max(0.0, waited + frame.took - 33);
    }
    return deadline;
}

TEST(Deadline, WithTimeToSpareEveryFrameGetsWhatWasAskedFor) {
    const auto deadline = after(100, 20, 100, 7);
    EXPECT_EQ(deadline.lowered(), 0u);
    EXPECT_EQ(deadline.late(), 0u);
}

TEST(Deadline, WithoutOneNothingIsLateOrLowered) {
    const auto deadline = after(100, 200, 0);
    EXPECT_EQ(deadline.lowered(), 0u);
    EXPECT_EQ(deadline.late(), 0u);
}

TEST(Deadline, AFrameThatWouldBeLateGetsLess) {
    auto deadline = after(20, 30, 60);
    EXPECT_EQ(deadline.effort(0), 5);
    const int hurried = deadline.effort(26);
    EXPECT_LT(hurried, 5);
    EXPECT_GT(hurried, 0);
    EXPECT_EQ(deadline.effort(58), 0);
}

TEST(Deadline, AMachineThatIsTooSlowKeepsUpWithLess) {
    const auto deadline = after(300, 38, 66);
    EXPECT_EQ(deadline.late(), 0u);
    EXPECT_GT(deadline.lowered(), 0u);
    EXPECT_LT(deadline.lowered(), deadline.frames().size());
}

TEST(Deadline, FramesThatTakeUnusuallyLongDoNotCountForTheNext) {
    auto deadline = after(20, 20, 23);  // a common frame is just in time
    for (const bool patched : {true, false, false, false, false, true}) deadline.took({5, 0, patched ? 200.0 : 20.0});
    deadline.took({.effort = 5, .waited = 0, .took = 300, .intra = true});
    EXPECT_EQ(deadline.effort(0), 5);
}

TEST(Deadline, FollowsWhatFramesCommonlyTakeWithinThreeUpAndSevenDown) {
    auto deadline = after(20, 20, 30);
    for (int i = 0; i < 3; ++i) deadline.took({5, 0, 40});
    EXPECT_EQ(deadline.effort(0), 0);
    for (int i = 0; i < 7; ++i) deadline.took({5, 0, 20});
    EXPECT_EQ(deadline.effort(0), 5);
}

TEST(Deadline, MotionAloneThatTakesLongKeepsNoFrameBehindItFromMore) {
    auto deadline = after(20, 20, 30);
    for (int i = 0; i < 9; ++i) deadline.took({0, 40, 25});
    EXPECT_EQ(deadline.effort(0), 5);
}

TEST(Deadline, MotionAloneTellsOfAMachineThatBecomesFaster) {
    auto deadline = after(20, 60, 40);
    EXPECT_LE(deadline.effort(0), 1);
    for (int i = 0; i < 9; ++i) deadline.took({0, 0, 10});
    EXPECT_EQ(deadline.effort(0), 5);
}

TEST(Deadline, MotionAloneIsNotCodedForever) {
    const auto deadline = after(100, 400, 50);
    std::size_t row = 0;
    for (const auto& frame : deadline.frames()) {
        row = frame.effort == 0 ? row + 1 : 0;
        EXPECT_LE(row, Deadline::most_alone);
    }
    EXPECT_GT(deadline.late(), 0u);
}

TEST(Deadline, AnIFrameIsNeverMotionAloneNorLessThanWasAskedFor) {
    Deadline deadline(50, 5);
    deadline.took({.effort = 0, .waited = 0, .took = 20, .intra = true});
    deadline.took({.effort = 0, .waited = 0, .took = 20});
    deadline.took({.effort = 3, .waited = 0, .took = 20});
    EXPECT_EQ(deadline.alone(), 1u);
    EXPECT_EQ(deadline.lowered(), 2u);
    const auto json = deadline_json(deadline);
    EXPECT_EQ(json["intra_frames"], 1);
    EXPECT_EQ(json["frames_by_effort"], (std::vector<int>{1, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
}

TEST(Deadline, WhereHalfOfTheFramesAreLateAWarningSaysWhatHelps) {
    Deadline deadline(50, 5);
    for (const double took : {20.0, 30.0, 60.0}) deadline.took({5, 0, took});
    EXPECT_EQ(deadline_warning(deadline, {.piped = true}), "");
    deadline.took({0, 0, 60.0});
    EXPECT_EQ(deadline_warning(deadline, {.piped = true}),
              "2 of 4 frames were late: this machine is too slow for the deadline, or the meshes came faster than a "
              "camera's, as from a file; what helps is a larger --deadline, a lower -q, meshes of fewer vertices or "
              "--drop-late, which leaves frames out");
    EXPECT_EQ(deadline_warning(deadline, {.piped = true, .dropped = true}),
              "2 of 4 frames were late: this machine is too slow for the deadline, or the meshes came faster than a "
              "camera's, as from a file; what helps is a larger --deadline, a lower -q or meshes of fewer vertices");
    Deadline least(50, 1);
    least.took({1, 0, 60.0});
    EXPECT_EQ(deadline_warning(least, {}),
              "1 of 1 frame was late: this machine is too slow for the deadline; what helps is a larger --deadline, a "
              "lower -q or meshes of fewer vertices");
}

TEST(Deadline, WhereATenthOfTheFramesWasNotRepairedAWarningSaysSo) {
    Deadline deadline(50, 5);
    for (int i = 0; i < 18; ++i) deadline.took({5, 0, 20.0});
    deadline.took({.effort = 5, .took = 20, .left_lost = true});
    EXPECT_EQ(deadline_warning(deadline, {}), "");
    deadline.took({.effort = 5, .took = 20, .left_lost = true});
    EXPECT_EQ(deadline_warning(deadline, {}),
              "2 of 20 frames show what tracking lost in them, as repairing it takes longer than the deadline; what "
              "helps is a larger --deadline, a lower -q or meshes of fewer vertices");
}

TEST(Deadline, TellsTheMedianTheNinetyNinthPercentileAndTheLongest) {
    std::vector<TimedFrame> frames;
    for (int i = 1; i <= 100; ++i) frames.push_back({5, 1.0 * i, 1.0 * i});
    const auto latency = latency_of(frames);
    EXPECT_NEAR(latency.median, 101, 1.01);
    EXPECT_NEAR(latency.p99, 199, 1.01);
    EXPECT_EQ(latency.longest, 200);
    EXPECT_EQ(latency_of({}).longest, 0);
}

TEST(Deadline, ALostFrameIsRepairedWhereThereIsTime) {
    Deadline deadline(100, 5);
    EXPECT_TRUE(deadline.may_repair(20, 0));  // nobody knows yet how long it takes
    deadline.took({.effort = 5, .waited = 0, .took = 80, .repaired = 60});
    EXPECT_TRUE(deadline.may_repair(40, 0));
    EXPECT_FALSE(deadline.may_repair(41, 0));
    EXPECT_TRUE(Deadline(0, 5).may_repair(1e6, 0));  // without a deadline there always is
}

TEST(Deadline, ThreeTenthsOfASecondAfterItWasLostAFrameIsRepairedWhateverItTakes) {
    for (const std::int64_t period_us : {100'000, 33'333}) {
        Deadline deadline(33, 5);
        deadline.took({.effort = 5, .waited = 0, .took = 80, .repaired = 60});
        std::int64_t now_us = 5'000'000;
        std::size_t lost = 0;
        for (; !deadline.may_repair(10, now_us); now_us += period_us, ++lost)
            deadline.took({.effort = 5, .took = 20, .left_lost = true, .timestamp_us = now_us});
        EXPECT_EQ(lost, period_us == 100'000 ? 3u : 10u);
        EXPECT_EQ(deadline_json(deadline)["unrepaired_frames"], lost);
        deadline.took({.effort = 5, .took = 80, .repaired = 60, .timestamp_us = now_us});
        EXPECT_FALSE(deadline.may_repair(10, now_us + period_us));
    }
}

TEST(Deadline, AFrameThatTrackingFindsAgainEndsWhatWasLost) {
    Deadline deadline(33, 5);
    deadline.took({.effort = 5, .took = 80, .repaired = 60});
    deadline.took({.effort = 5, .took = 20, .left_lost = true, .timestamp_us = 0});
    deadline.took({.effort = 5, .took = 20, .timestamp_us = 200'000});
    EXPECT_FALSE(deadline.may_repair(10, 400'000));
}

TEST(Deadline, WhileTrackingIsLostNoFrameIsMotionAlone) {
    auto deadline = after(20, 30, 33);
    EXPECT_EQ(deadline.effort(30), 0);
    deadline.took({.effort = 5, .took = 30, .left_lost = true});
    EXPECT_EQ(deadline.effort(30), 1);
    deadline.took({.effort = 1, .took = 30});
    EXPECT_EQ(deadline.effort(30), 0);
}

}  // namespace
}  // namespace htvm::app
