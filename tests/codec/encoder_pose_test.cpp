#include <gtest/gtest.h>

#include "codec/encoder/bones/motion.h"
#include "codec/encoder/pose_tracker.h"

namespace htvm::internal {
namespace {

Mesh tall() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {10, 0, 0}, {0, 100, 0}, {10, 100, 0}};
    return mesh;
}

Mesh moved(Mesh mesh, float x) {
    for (auto& p : mesh.positions) p[0] += x;
    return mesh;
}

Skeleton one_bone() {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b"};
    skeleton.bones = {{0, 1}};
    return skeleton;
}

Pose pose_at(double y) { return {{{0, y, 0}, {0, y + 50, 0}}, {}, {}}; }

const Lattice lattice = {.origin = {0, 0, 0}, .bits = 4};

TEST(PoseTracker, WithoutASkeletonOneBoneSpansTheMeshAndFollowsItsMiddle) {
    auto tracker = make_pose_tracker({}, tall(), nullptr);
    ASSERT_TRUE(tracker.has_value());
    EXPECT_FALSE(tracker->has_skeleton);
    ASSERT_EQ(tracker->skeleton.bones.size(), 1u);
    EXPECT_EQ(tracker->next(tall(), nullptr, lattice)->joints, (std::vector<LatticePoint>{{80, 0, 0}, {80, 1600, 0}}));
    EXPECT_EQ(tracker->next(moved(tall(), 1000), nullptr, lattice)->joints,
              (std::vector<LatticePoint>{{16080, 0, 0}, {16080, 1600, 0}}));
    EXPECT_TRUE(tracker->next({}, nullptr, lattice).has_value()) << "a frame without vertices";
}

TEST(PoseTracker, TheStandInStaysOnTheLattice) {
    auto tracker = make_pose_tracker({}, tall(), nullptr);
    const auto far = tracker->next(moved(tall(), 1e6f), nullptr, lattice);
    ASSERT_TRUE(far.has_value());
    for (const auto joint : far->joints) EXPECT_TRUE(on_lattice(joint));
}

TEST(PoseTracker, KeepsTheLastPoseWhereThereIsNone) {
    const auto first = pose_at(0), second = pose_at(20);
    auto tracker = make_pose_tracker(one_bone(), tall(), &first);
    ASSERT_TRUE(tracker.has_value());
    EXPECT_TRUE(tracker->has_skeleton);
    const auto at_second = tracker->next(tall(), &second, lattice);
    const auto lost = tracker->next(tall(), nullptr, lattice);
    EXPECT_EQ(lost->joints, at_second->joints);
    EXPECT_EQ(lost->orientations, at_second->orientations);
    EXPECT_EQ(lost->joints[0], (LatticePoint{0, 320, 0}));
}

TEST(PoseTracker, AFrameInErrorDoesNotChangeTheLastPose) {
    const auto first = pose_at(0);
    auto far = pose_at(1e9), broken = pose_at(5);
    broken.joints.pop_back();
    auto tracker = make_pose_tracker(one_bone(), tall(), &first);
    EXPECT_FALSE(tracker->next(tall(), &far, lattice).has_value());
    EXPECT_FALSE(tracker->next(tall(), &broken, lattice).has_value());
    EXPECT_EQ(tracker->next(tall(), nullptr, lattice)->joints[0], (LatticePoint{0, 0, 0}));
}

TEST(PoseTracker, GivenOrientationsAreTaken) {
    auto pose = pose_at(0);
    pose.orientations = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};  // a quarter turn about z
    auto tracker = make_pose_tracker(one_bone(), tall(), &pose);
    const auto coded = tracker->next(tall(), &pose, lattice);
    EXPECT_EQ(coded->orientations[0], quantise_rotation({1, 0, 0, 1}));
}

TEST(PoseTracker, ASkeletonNeedsAPoseForTheFirstFrame) {
    const auto tracker = make_pose_tracker(one_bone(), tall(), nullptr);
    ASSERT_FALSE(tracker.has_value());
    EXPECT_EQ(tracker.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm::internal
