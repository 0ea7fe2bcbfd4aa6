// How the synthetic person moves.
#include "synth/motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

namespace htvm::synth {
namespace {

TEST(Motion, JointsMoveAtHumanSpeedsWithoutJumps) {
    constexpr double step = 1.0 / 240;
    PosedBody before = pose_body(0);
    for (double t = step; t < 20; t += step) {
        const PosedBody now = pose_body(t);
        for (std::size_t j = 0; j < joint_count; ++j)
            ASSERT_LT((now.joints[j] - before.joints[j]).norm() / step, 7000.0) << "mm/s, joint " << j << " at " << t;
        before = now;
    }
}

TEST(Motion, VelocitiesDoNotJump) {
    constexpr double step = 1.0 / 480;
    PosedBody last = pose_body(0), now = pose_body(step);
    for (double t = 2 * step; t < 17; t += step) {
        const PosedBody next = pose_body(t);
        for (std::size_t j = 0; j < joint_count; ++j) {
            const double change = (next.joints[j] - 2 * now.joints[j] + last.joints[j]).norm() / step;
            ASSERT_LT(change, 2600.0) << "mm/s, joint " << j << " at " << t;  // take-off is the sharpest
        }
        last = now;
        now = next;
    }
}

TEST(Motion, LimbsKeepTheirLength) {
    constexpr std::array<std::pair<std::size_t, std::size_t>, 9> rigid = {
        {{3, 4}, {4, 5}, {6, 7}, {7, 8}, {9, 10}, {10, 11}, {12, 13}, {13, 14}, {2, 9}}};
    const auto& rest = rest_joints();
    for (double t = 0; t < 12; t += 0.1) {
        const PosedBody body = pose_body(t);
        for (const auto& [a, b] : rigid)
            EXPECT_NEAR((body.joints[a] - body.joints[b]).norm(), (rest[a] - rest[b]).norm(), 1e-6);
    }
}

TEST(Motion, ThePersonWalksWavesTurnsAndJumps) {
    double walked = 0, highest_hand = 0, highest_feet = 0, turned = 0;
    PosedBody before = pose_body(0.5);
    for (double t = 0.5; t < 8.4; t += 1.0 / 60) {
        const PosedBody body = pose_body(t);
        walked += (body.parts[0].pivot - before.parts[0].pivot).norm();
        highest_hand = std::max(highest_hand, body.joints[8].y() - body.joints[0].y());
        highest_feet = std::max(highest_feet, std::min(body.joints[11].y(), body.joints[14].y()));
        const auto &now = body.parts[0].rotation, &last = before.parts[0].rotation;
        turned += now.col(2).cross(last.col(2)).dot(-now.col(1));
        before = body;
    }
    EXPECT_GT(walked, 2000);        // mm
    EXPECT_GT(highest_hand, 50);    // above the middle of the head
    EXPECT_GT(highest_feet, 300);   // both ankles
    EXPECT_GT(turned, 6.28 + 2.0);  // the turn on the spot and the circle
}

TEST(Motion, APoseIsTheTPoseOfTheRestJointsAtTimeZeroAndBefore) {
    for (const double t : {0.0, -1.0}) {
        const PosedBody body = pose_body(t);
        for (std::size_t j = 0; j < joint_count; ++j)
            EXPECT_LT((body.joints[j] - rest_joints()[j]).norm(), 1e-6) << "joint " << j;
    }
}

}  // namespace
}  // namespace htvm::synth
