#include "io/skeleton_align.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/orientation.h"

namespace htvm {

using namespace internal;
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Two joints, one bone of 100 mm along +y, its first joint at x = 10 t in pose t.
SkeletonTrack moving_bone(std::size_t count, double fps) {
    SkeletonTrack track;
    track.skeleton.joint_names = {"a", "b"};
    track.skeleton.bones = {{0, 1}};
    track.fps = fps;
    for (std::size_t t = 0; t < count; ++t) {
        Pose pose;
        const double x = 10 * static_cast<double>(t);
        pose.joints = {{x, 0, 0}, {x, 100, 0}};
        track.poses.push_back(pose);
        track.timestamps.push_back(static_cast<double>(t) / fps);
    }
    return track;
}

MeshClock mesh_at(std::size_t frames, double fps) { return {.frames = frames, .fps = fps, .timestamps = {}}; }

double first_x(const Result<AlignedPoses>& aligned, std::size_t t) { return aligned->poses[t].joints[0][0]; }

TEST(AlignSkeleton, EqualRatesTakeThePosesAsTheyAre) {
    for (const double fps : {30.0, 0.0, 29.97}) {
        const auto aligned = align(moving_bone(5, 30), mesh_at(5, fps));
        ASSERT_TRUE(aligned) << aligned.error().message;
        ASSERT_EQ(aligned->poses.size(), 5u);
        for (std::size_t t = 0; t < 5; ++t) {
            EXPECT_EQ(first_x(aligned, t), 10 * static_cast<double>(t));
            EXPECT_TRUE(aligned->poses[t].found[0] && aligned->poses[t].found[1]);
        }
        EXPECT_EQ(aligned->notes.size(), 0u);
    }
}

TEST(AlignSkeleton, OtherRatesAreInterpolatedByTime) {
    const auto doubled = align(moving_bone(4, 30), mesh_at(7, 60));
    ASSERT_TRUE(doubled);
    for (std::size_t t = 0; t < 7; ++t) {
        EXPECT_NEAR(first_x(doubled, t), 5 * static_cast<double>(t), 1e-9);
        EXPECT_TRUE(doubled->poses[t].found[0]);
    }
    EXPECT_THAT(doubled->notes, Contains(HasSubstr("30 poses per second, the meshes 60")));
    const auto thirded = align(moving_bone(7, 90), mesh_at(3, 30));
    ASSERT_TRUE(thirded);
    for (std::size_t t = 0; t < 3; ++t) EXPECT_EQ(first_x(thirded, t), 30 * static_cast<double>(t));
}

TEST(AlignSkeleton, MeshTimestampsAreFollowed) {
    MeshClock mesh = mesh_at(3, 0);
    mesh.timestamps = {0.0, 0.05, 0.1};
    const auto aligned = align(moving_bone(2, 10), mesh);
    ASSERT_TRUE(aligned);
    EXPECT_EQ(first_x(aligned, 0), 0);
    EXPECT_NEAR(first_x(aligned, 1), 5, 1e-9);
    EXPECT_EQ(first_x(aligned, 2), 10);
    AlignOptions late;
    late.offset = 0.05;  // the skeleton's clock is 50 ms behind
    const auto shifted = align(moving_bone(2, 10), mesh, late);
    EXPECT_NEAR(first_x(shifted, 1), 0, 1e-9);
    EXPECT_NEAR(first_x(shifted, 2), 5, 1e-9);
    mesh.timestamps = {1000.0, 1000.05, 1000.1};
    const auto apart = align(moving_bone(2, 10), mesh);
    EXPECT_NEAR(first_x(apart, 1), 5, 1e-9);
    EXPECT_THAT(apart->notes, Contains(HasSubstr("do not overlap")));
}

TEST(AlignSkeleton, AMissingJointIsInterpolatedInTimeAndMarked) {
    auto track = moving_bone(5, 30);
    for (const std::size_t t : {1u, 2u}) {
        track.poses[t].found = {false, true};
        track.poses[t].joints[0] = {};
    }
    const auto aligned = align(track, mesh_at(5, 30));
    ASSERT_TRUE(aligned);
    EXPECT_NEAR(first_x(aligned, 1), 10, 1e-9);
    EXPECT_NEAR(first_x(aligned, 2), 20, 1e-9);
    EXPECT_FALSE(aligned->poses[1].found[0]);
    EXPECT_TRUE(aligned->poses[1].found[1]);
    EXPECT_TRUE(aligned->poses[3].found[0]);
    EXPECT_THAT(aligned->notes, Contains(HasSubstr("missing in 2 mesh frames")));
}

TEST(AlignSkeleton, AMissingFrameIsInterpolatedAndTheEndsAreHeld) {
    auto track = moving_bone(6, 30);
    track.poses[0] = track.poses[2] = track.poses[5] = Pose{};
    const auto aligned = align(track, mesh_at(6, 30));
    ASSERT_TRUE(aligned);
    EXPECT_EQ(first_x(aligned, 0), 10);
    EXPECT_NEAR(first_x(aligned, 2), 20, 1e-9);
    EXPECT_EQ(first_x(aligned, 5), 40);
    for (std::size_t t = 0; t < 6; ++t) EXPECT_EQ(aligned->poses[t].found[0], t != 0 && t != 2 && t != 5) << t;
    EXPECT_THAT(aligned->notes, Contains(HasSubstr("missing in 3 mesh frames of 6")));
}

TEST(AlignSkeleton, AShorterSkeletonIsHeldAndALongerOneCutAndBothAreSaid) {
    const auto held = align(moving_bone(3, 30), mesh_at(5, 30));
    ASSERT_TRUE(held);
    EXPECT_EQ(first_x(held, 4), 20);
    EXPECT_FALSE(held->poses[4].found[0]);
    EXPECT_THAT(held->notes, Contains(HasSubstr("does not cover 2 mesh frames of 5 at the ends, frames 3 to 4")));
    AlignOptions first_three;
    first_three.used = 3;
    EXPECT_THAT(align(moving_bone(3, 30), mesh_at(5, 30), first_three)->notes,
                Not(Contains(HasSubstr("does not cover"))));
    const auto cut = align(moving_bone(5, 30), mesh_at(3, 30));
    ASSERT_TRUE(cut);
    EXPECT_EQ(first_x(cut, 2), 20);
    EXPECT_THAT(cut->notes, Contains(HasSubstr("not used")));
}

TEST(AlignSkeleton, FramesTheTrackerSkippedAreFilledIn) {
    auto track = moving_bone(6, 30);
    track.poses.erase(track.poses.begin() + 2, track.poses.begin() + 4);
    track.timestamps.erase(track.timestamps.begin() + 2, track.timestamps.begin() + 4);
    const auto aligned = align(track, mesh_at(6, 30));
    ASSERT_TRUE(aligned);
    for (std::size_t t = 0; t < 6; ++t) {
        EXPECT_NEAR(first_x(aligned, t), 10 * static_cast<double>(t), 1e-9);
        EXPECT_EQ(aligned->poses[t].found[0], t != 2 && t != 3) << t;
    }
}

TEST(AlignSkeleton, AJointThatIsNeverTrackedIsPutWhereItsNeighbourIs) {
    auto track = moving_bone(2, 30);
    track.skeleton.joint_names = {"a", "b", "c", "d"};
    track.skeleton.bones = {{0, 1}, {1, 2}};
    for (auto& pose : track.poses) {
        pose.joints.resize(4);
        pose.found = {true, true, false, false};
    }
    const auto aligned = align(track, mesh_at(2, 30));
    ASSERT_TRUE(aligned) << aligned.error().message;
    EXPECT_EQ(aligned->poses[1].joints[2], (Vector3d{10, 100, 0}));
    EXPECT_EQ(aligned->poses[1].joints[3], (Vector3d{10, 0, 0}));
    EXPECT_FALSE(aligned->poses[1].found[2]);
    EXPECT_THAT(aligned->notes, Contains(HasSubstr("\"c\" is tracked in no frame")));
}

TEST(AlignSkeleton, GivenOrientationsAreInterpolatedAndTheRestDerived) {
    auto track = moving_bone(3, 10);
    track.skeleton.joint_names.push_back("c");
    track.skeleton.bones.push_back({1, 2});
    const Rotation quarter = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    for (auto& pose : track.poses) {
        pose.joints.push_back({pose.joints[1][0] + 50, 100, 0});
        pose.orientations = {unknown_orientation, unknown_orientation};
    }
    track.poses[0].orientations[0] = identity_rotation;
    track.poses[1].orientations[0] = quarter;
    const auto aligned = align(track, mesh_at(5, 20));
    ASSERT_TRUE(aligned);
    const double half = std::sqrt(0.5);
    const Rotation eighth = {half, -half, 0, half, half, 0, 0, 0, 1};
    for (std::size_t i = 0; i < 9; ++i) {
        EXPECT_EQ(aligned->poses[0].orientations[0][i], identity_rotation[i]);
        EXPECT_NEAR(aligned->poses[1].orientations[0][i], eighth[i], 1e-12);
        EXPECT_EQ(aligned->poses[2].orientations[0][i], quarter[i]);
        EXPECT_EQ(aligned->poses[4].orientations[0][i], quarter[i]);  // held
        EXPECT_NEAR(aligned->poses[3].orientations[1][i], identity_rotation[i], 1e-12);
    }
    AlignOptions given_only;
    given_only.derive_orientations = false;
    EXPECT_EQ(align(track, mesh_at(3, 10), given_only)->poses[0].orientations[1], unknown_orientation);
    EXPECT_THAT(align(moving_bone(2, 10), mesh_at(2, 10), given_only)->poses[0].orientations, IsEmpty());
}

TEST(AlignSkeleton, WhatCannotBeAlignedIsAnError) {
    EXPECT_TRUE(align(SkeletonTrack{}, mesh_at(0, 30)));
    EXPECT_FALSE(align(SkeletonTrack{}, mesh_at(1, 30)));
    EXPECT_FALSE(align(moving_bone(0, 30), mesh_at(1, 30)));
    auto track = moving_bone(2, 30);
    track.poses[0] = track.poses[1] = Pose{};
    EXPECT_FALSE(align(track, mesh_at(2, 30)));
    track = moving_bone(2, 30);
    track.poses[1].joints.pop_back();
    EXPECT_FALSE(align(track, mesh_at(2, 30)));
    track = moving_bone(2, 30);
    track.timestamps[1] = 0;
    EXPECT_FALSE(align(track, mesh_at(2, 30)));
    track.timestamps.pop_back();
    EXPECT_FALSE(align(track, mesh_at(2, 30)));
    track = moving_bone(2, 30);
    track.poses[1].joints[0][2] = std::nan("");
    EXPECT_THAT(align(track, mesh_at(2, 30)).error().message, HasSubstr("pose 1"));
    track = moving_bone(2, 30);
    track.skeleton.bones.push_back({0, 2});
    EXPECT_FALSE(align(track, mesh_at(2, 30)));
    MeshClock mesh = mesh_at(2, 0);
    mesh.timestamps = {0};
    EXPECT_FALSE(align(moving_bone(2, 30), mesh));
    mesh.timestamps = {1, 0};
    EXPECT_FALSE(align(moving_bone(2, 30), mesh));
    EXPECT_FALSE(align(moving_bone(2, 30), mesh_at(2, -1)));
}

TEST(AlignSkeleton, RandomTracksGiveCompleteFinitePoses) {
    std::mt19937 random(11);
    for (int round = 0; round < 300; ++round) {
        SkeletonTrack track;
        const std::size_t joints = 1 + random() % 5, poses = random() % 8;
        for (std::size_t j = 0; j < joints; ++j) track.skeleton.joint_names.push_back(std::to_string(j));
        for (std::size_t b = 0; b < random() % 6 && joints > 1; ++b)
            track.skeleton.bones.push_back(
                {static_cast<std::uint16_t>(random() % joints), static_cast<std::uint16_t>(random() % joints)});
        double time = 0;
        bool any = false;
        for (std::size_t t = 0; t < poses; ++t) {
            Pose pose;
            for (std::size_t j = 0; j < joints && random() % 16; ++j) {
                pose.joints.push_back({static_cast<double>(random() % 9), static_cast<double>(random() % 9), 0});
                pose.found.push_back(random() % 3 > 0);
            }
            if (pose.joints.size() < joints) pose = Pose{};
            for (const bool tracked : pose.found) any = any || tracked;
            if (!pose.joints.empty() && random() % 2)
                pose.orientations.assign(track.skeleton.bones.size(),
                                         random() % 2 ? identity_rotation : unknown_orientation);
            track.poses.push_back(pose);
            track.timestamps.push_back(time += 0.001 + static_cast<double>(random() % 100) / 1000);
        }
        MeshClock mesh = mesh_at(random() % 10, static_cast<double>(random() % 3) * 20);
        if (round % 2)
            for (std::size_t t = 0; t < mesh.frames; ++t)
                mesh.timestamps.push_back(static_cast<double>(t * (round % 7)) / 50);
        const auto aligned = align(track, mesh);
        ASSERT_EQ(aligned.has_value(), any || mesh.frames == 0);
        if (!aligned) continue;
        ASSERT_EQ(aligned->poses.size(), mesh.frames);
        for (const Pose& pose : aligned->poses) {
            ASSERT_EQ(pose.joints.size(), joints);
            ASSERT_EQ(pose.found.size(), joints);
            ASSERT_EQ(pose.orientations.size(), track.skeleton.bones.size());
            for (const Vector3d& p : pose.joints)
                EXPECT_TRUE(p[0] >= 0 && p[0] <= 8 && p[1] >= 0 && p[1] <= 8 && p[2] == 0);
            for (const Rotation& r : pose.orientations) {
                const Rotation transposed = {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]};
                const Rotation product = multiply(r, transposed);
                for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(product[i], identity_rotation[i], 1e-9);
            }
        }
    }
}

}  // namespace
}  // namespace htvm
