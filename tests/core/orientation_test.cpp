#include "core/orientation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace htvm::internal {
namespace {

void expect_vector(const Vector3d& a, const Vector3d& b, double tolerance = 1e-9) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "component " << i;
}

void expect_same(const Rotation& a, const Rotation& b, double tolerance = 1e-9) {
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "element " << i;
}

void expect_rotation(const Rotation& r) {
    Rotation transposed = {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]};
    expect_same(multiply(r, transposed), identity_rotation, 1e-9);
    const double determinant =
        r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
    EXPECT_NEAR(determinant, 1, 1e-9);
}

Vector3d random_vector(std::mt19937& random) {
    std::normal_distribution<double> normal(0, 100);
    return {normal(random), normal(random), normal(random)};
}

Rotation about_z(double degrees) {
    const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
    return {c, -s, 0, s, c, 0, 0, 0, 1};
}

Rotation about_y(double degrees) {
    const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
    return {c, 0, s, 0, 1, 0, -s, 0, c};
}

// A small person, mm, y up: hips, torso, neck, head, two arms, two legs.
Skeleton person_skeleton() {
    Skeleton skeleton;
    skeleton.joint_names = {"torso", "neck", "head", "left hand", "right hand", "left foot", "right foot"};
    skeleton.bones = {{0, 1}, {1, 2}, {1, 3}, {1, 4}, {0, 5}, {0, 6}};
    return skeleton;
}

Pose person_in_t_pose() {
    Pose pose;
    pose.joints = {{0, 1000, 0},    {0, 1500, 0}, {0, 1700, 50}, {700, 1500, 0},
                   {-700, 1500, 0}, {150, 0, 0},  {-150, 0, 0}};
    return pose;
}

TEST(MinimalRotation, TakesOneDirectionToTheOtherByTheSmallestAngle) {
    std::mt19937 random(1);
    for (int i = 0; i < 500; ++i) {
        const Vector3d from = random_vector(random), to = random_vector(random);
        const Rotation r = minimal_rotation(from, to);
        expect_rotation(r);
        const double a = std::hypot(from[0], from[1], from[2]), b = std::hypot(to[0], to[1], to[2]);
        const Vector3d moved = rotate(r, from);
        expect_vector({moved[0] / a, moved[1] / a, moved[2] / a}, {to[0] / b, to[1] / b, to[2] / b});
        const double cosine = (from[0] * to[0] + from[1] * to[1] + from[2] * to[2]) / (a * b);
        EXPECT_NEAR((r[0] + r[4] + r[8] - 1) / 2, cosine, 1e-9);  // the angle follows from the trace
    }
}

TEST(MinimalRotation, OppositeDirectionsTurnHalfRoundAboutTheHint) {
    expect_same(minimal_rotation({1, 0, 0}, {-1, 0, 0}, {0, 1, 0}), {-1, 0, 0, 0, 1, 0, 0, 0, -1});
    const Rotation hint_along = minimal_rotation({1, 0, 0}, {-1, 0, 0}, {1, 0, 0});
    expect_rotation(hint_along);
    expect_vector(rotate(hint_along, {1, 0, 0}), {-1, 0, 0});
}

TEST(MinimalRotation, NearlyOppositeDirectionsStillGiveARotation) {
    for (double tilt = 1; tilt > 1e-20; tilt /= 3) {
        const Rotation r = minimal_rotation({0, 5, 0}, {tilt, -5, tilt / 7});
        expect_rotation(r);
        expect_vector(rotate(r, {0, std::hypot(tilt, 5.0, tilt / 7), 0}), {tilt, -5, tilt / 7}, 1e-6);
    }
}

TEST(MinimalRotation, WithoutADirectionIsTheIdentity) {
    expect_same(minimal_rotation({0, 0, 0}, {1, 0, 0}), identity_rotation);
    expect_same(minimal_rotation({1, 0, 0}, {0, 0, 0}), identity_rotation);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_same(minimal_rotation({1, nan, 0}, {0, 1, 0}), identity_rotation);
}

TEST(Orthonormalised, KeepsARotationAndMendsARoundedOne) {
    expect_same(orthonormalised(about_z(30)), about_z(30), 1e-15);
    const Rotation rounded = {0.866, -0.5, 0, 0.5, 0.866, 0, 0, 0, 1};
    expect_rotation(orthonormalised(rounded));
    expect_same(orthonormalised(rounded), about_z(30), 1e-3);
    expect_same(orthonormalised(Rotation{}), identity_rotation);
}

TEST(BoneOrientation, ItsFirstAxisLiesAlongTheBone) {
    expect_same(bone_orientation({1, 1, 1}, {5, 1, 1}, nullptr), identity_rotation);
    expect_same(bone_orientation({0, 0, 0}, {0, 9, 0}, nullptr), about_z(90));
    std::mt19937 random(2);
    for (int i = 0; i < 200; ++i) {
        const Vector3d first = random_vector(random), second = random_vector(random);
        const Rotation r = bone_orientation(first, second, nullptr);
        expect_rotation(r);
        const double size = std::hypot(second[0] - first[0], second[1] - first[1], second[2] - first[2]);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(r[3 * c] * size, second[c] - first[c], 1e-9);
    }
}

TEST(BoneOrientation, ABoneThatDoesNotMoveKeepsThePreviousTwist) {
    const Rotation twisted = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    expect_same(bone_orientation({0, 0, 0}, {3, 0, 0}, &twisted), twisted);
}

TEST(BoneOrientation, AZeroLengthBoneKeepsThePreviousOneOrTheIdentity) {
    const Rotation previous = about_z(40);
    expect_same(bone_orientation({1, 2, 3}, {1, 2, 3}, &previous), previous);
    expect_same(bone_orientation({1, 2, 3}, {1, 2, 3}, nullptr), identity_rotation);
}

TEST(DeriveOrientations, IsTheMinimalRotationFromTheReferenceTimesItsOrientation) {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b"};
    skeleton.bones = {{0, 1}};
    Pose reference, pose;
    reference.joints = {{0, 0, 0}, {10, 0, 0}};
    reference.orientations = {{0, 0, 1, 1, 0, 0, 0, 1, 0}};
    pose.joints = {{5, 5, 5}, {5, 25, 5}};
    const auto derived = derive_orientations(skeleton, pose, &reference);
    ASSERT_EQ(derived.size(), 1u);
    expect_same(derived[0], multiply(about_z(90), reference.orientations[0]));
}

TEST(DeriveOrientations, ZeroLengthBonesAndMissingJointsAreHandled) {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b"};
    skeleton.bones = {{0, 1}, {1, 7}};
    Pose pose, reference;
    pose.joints = {{1, 1, 1}, {1, 1, 1}};
    reference.joints = {{0, 0, 0}, {0, 10, 0}};
    const auto derived = derive_orientations(skeleton, pose, &reference);
    expect_same(derived[0], about_z(90));
    expect_same(derived[1], identity_rotation);
    expect_same(derive_orientations(skeleton, reference, &pose)[0], about_z(90));
    expect_same(derive_orientations(skeleton, Pose{}, nullptr)[0], identity_rotation);
    EXPECT_TRUE(derive_orientations(Skeleton{}, Pose{}, nullptr).empty());
    EXPECT_EQ(derive_turning_orientations(skeleton, pose, reference).size(), 2u);
}

TEST(DeriveTurningOrientations, ABodyThatTurnsAsAWholeTurnsAllItsBones) {
    const Skeleton skeleton = person_skeleton();
    const Pose reference = person_in_t_pose();
    const auto before = derive_orientations(skeleton, reference, nullptr);
    for (double degrees = -180; degrees <= 180; degrees += 15) {
        Pose pose = reference;
        for (auto& joint : pose.joints) {
            joint = rotate(about_y(degrees), joint);
            joint[0] += 300;
        }
        const auto after = derive_turning_orientations(skeleton, pose, reference);
        for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
            SCOPED_TRACE(testing::Message() << degrees << " degrees, bone " << b);
            expect_same(after[b], multiply(about_y(degrees), before[b]), 1e-5);
        }
    }
}

TEST(DeriveTurningOrientations, JointsInLineWithTheBoneGiveNoTwist) {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b", "c"};
    skeleton.bones = {{0, 1}, {1, 2}};
    Pose reference, pose;
    reference.joints = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}};
    pose.joints = {{0, 0, 0}, {0, 10, 0}, {0, 20, 0}};
    const auto derived = derive_turning_orientations(skeleton, pose, reference);
    expect_same(derived[0], about_z(90));
    expect_same(derived[1], about_z(90));
}

TEST(DeriveTurningOrientations, RandomPosesGiveRotationsAlongTheBones) {
    std::mt19937 random(3);
    const Skeleton skeleton = person_skeleton();
    for (int i = 0; i < 100; ++i) {
        Pose reference, pose;
        for (std::size_t j = 0; j < skeleton.joint_names.size(); ++j) {
            reference.joints.push_back(random_vector(random));
            pose.joints.push_back(random_vector(random));
        }
        const auto derived = derive_turning_orientations(skeleton, pose, reference);
        for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
            expect_rotation(derived[b]);
            const Vector3d& a = pose.joints[skeleton.bones[b].first];
            const Vector3d& c = pose.joints[skeleton.bones[b].second];
            const double size = std::hypot(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
            for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(derived[b][3 * k], (c[k] - a[k]) / size, 1e-9);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
