#include "codec/encoder/bones/motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "codec/random_numbers.h"
#include "codec/tfan_test_meshes.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

RigidMotion random_motion(std::mt19937& random, double angle, double reach) {
    std::uniform_real_distribution<double> one(-1, 1);
    RigidMotion out;
    out.rotation = Eigen::AngleAxisd(angle * one(random), Vector3d(one(random), one(random), one(random)).normalized())
                       .toRotationMatrix();
    out.shift = reach * Vector3d(one(random), one(random), one(random));
    return out;
}

Vector3d real(LatticePoint p) { return {p.x * 1.0, p.y * 1.0, p.z * 1.0}; }

LatticePoint rounded(const Vector3d& v) {
    auto c = [](double x) { return static_cast<std::int32_t>(std::lround(x)); };
    return {c(v.x()), c(v.y()), c(v.z())};
}

// An ellipsoid around the given middle, lattice units.
void add_limb(LatticeMesh& mesh, LatticePoint middle) {
    const auto sphere = tfan_test::perturbed_sphere(38, 40, 1);  // of radius 5000
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto p : sphere.positions)
        mesh.positions.push_back(middle + LatticePoint{p.x * 3 / 10, p.z, p.y * 2 / 10});
    for (const auto& t : sphere.triangles) mesh.triangles.push_back({base + t[0], base + t[1], base + t[2]});
}

const std::vector<Bone> bones = {{0, 1}, {2, 3}};
const std::vector<LatticePoint> joints = {{-8000, -5000, 0}, {-8000, 5000, 0}, {8000, -5000, 0}, {8000, 5000, 0}};
const std::vector<std::int32_t> radii = {1500, 1500};

ReferenceMesh two_limbs() {
    LatticeMesh mesh;
    add_limb(mesh, {-8000, 0, 0});
    add_limb(mesh, {8000, 0, 0});
    return make_reference(std::move(mesh), bones, joints, std::vector<QuantisedRotation>(2), radii, 0, 0, {});
}

TEST(QuantisedMotion, IsTheMotionToWithinHalfAUnitAndTwoQuantaOfTurning) {
    std::mt19937 random(1);
    for (int i = 0; i < 5000; ++i) {
        const auto motion = random_motion(random, 3, 20000);
        const LatticePoint pivot{test::between(random, -20000, 20000), test::between(random, -20000, 20000), 77};
        const auto back = motion_of(quantise_motion(motion, pivot), pivot);
        EXPECT_LE((back(real(pivot)) - motion(real(pivot))).cwiseAbs().maxCoeff(), 0.5 + 1e-6) << "the pivot";
        const Vector3d v = real(pivot) + Vector3d(0, 8000, 0);  // half a metre away
        EXPECT_LE((back(v) - motion(v)).norm(), 0.9 + 8000 * std::sqrt(3.0) / 8192 + 0.01);
    }
}

TEST(QuantisedMotion, NoMotionIsTheTransformThatCostsNothing) {
    EXPECT_EQ(quantise_motion({}, {5, 6, 7}), QuantisedTransform{});
}

TEST(QuantisedMotion, OutOfReachIsClampedToTheLattice) {
    RigidMotion motion;
    motion.shift = {1e12, -1e12, 0};
    EXPECT_EQ(quantise_motion(motion, {}).shift, (LatticePoint{lattice_limit, -lattice_limit, 0}));
}

TEST(QuantisedMotion, MovesALatticePointAsTheDecoderDoes) {
    std::mt19937 random(2);
    for (int i = 0; i < 2000; ++i) {
        const LatticePoint pivot{test::between(random, -9000, 9000), 5, 6},
            v{100, test::between(random, -9000, 9000), 3};
        const auto transform = quantise_motion(random_motion(random, 3, 9000), pivot);
        const auto moved = move(v, rotation_matrix(transform.rotation), pivot, transform.shift);
        EXPECT_LE((motion_of(transform, pivot)(real(v)) - real(moved)).cwiseAbs().maxCoeff(), 0.51);
    }
}

TEST(QuantisedOrientation, OfARowMajorMatrixIsThatRotation) {
    std::mt19937 random(3);
    for (int i = 0; i < 500; ++i) {
        const Eigen::Matrix3d rotation = random_motion(random, 3.1, 0).rotation;
        Rotation rows{};
        for (int k = 0; k < 9; ++k) rows[static_cast<std::size_t>(k)] = rotation(k / 3, k % 3);
        EXPECT_LT((matrix_of(quantise_orientation(rows)) - rotation).norm(), 1e-3);
    }
}

TEST(SkeletalMotion, TakesEachFirstJointToItsPlaceAndTurnsByTheOrientations) {
    const auto reference = two_limbs();
    CodedPose pose{joints, std::vector<QuantisedRotation>(2)};
    pose.joints[0] = {-8000, -5000, 300};
    pose.orientations[0] = quantise_rotation({1, 0, 0, 1});  // a quarter turn about z
    const auto motion = skeletal_motion(reference, bones, pose);
    ASSERT_EQ(motion.size(), 2u);
    EXPECT_LT((motion[0](real(joints[0])) - real(pose.joints[0])).norm(), 1e-6);
    EXPECT_LT((motion[0](real(joints[1])) - Vector3d(-18000, -5000, 300)).norm(), 1e-3);
    EXPECT_LT((motion[1].rotation - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_LT(motion[1].shift.norm(), 1e-9);
}

TEST(BoneRegistration, RecoversTheMotionOfEachBone) {
    const auto reference = two_limbs();
    const auto search = make_reference_search(reference);
    ASSERT_EQ(search.sub_mesh.size(), 2u);
    EXPECT_EQ(search.sub_mesh[0].size(), 1522u);
    EXPECT_EQ(search.normals[1].size(), 1522u);
    std::mt19937 random(4);
    const std::vector<RigidMotion> truth = {random_motion(random, 0.03, 80), random_motion(random, 0.03, 80)};
    std::vector<LatticePoint> frame;
    for (std::size_t k = 0; k < reference.mesh.positions.size(); ++k)
        frame.push_back(rounded(truth[reference.bone_of_vertex[k]](real(reference.mesh.positions[k]))));
    const std::vector<RigidMotion> none(2);
    for (const bool planes : {false, true}) {
        RegistrationOptions options;
        options.iterations = 60;
        options.point_to_plane = planes;
        for (const unsigned threads : {1u, 3u}) {
            const auto found =
                register_bones(search, frame, reference.sub_meshes, none, {}, options, ThreadPool(threads));
            for (std::size_t bone = 0; bone < 2; ++bone) {
                const Vector3d middle = real(reference.pivots[bone]);
                EXPECT_LT((found[bone](middle) - truth[bone](middle)).norm(), 60) << planes;
                EXPECT_LT((found[bone].rotation - truth[bone].rotation).norm(), 0.02) << planes;
            }
        }
    }
}

TEST(BoneRegistration, NormalsThatMeanNothingDoNotLeadAstray) {
    auto mesh = two_limbs().mesh;
    std::mt19937 random(6);
    const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
    for (auto& t : mesh.triangles)
        for (auto& v : t) v = test::below(random, vertices);
    const auto reference = make_reference(mesh, bones, joints, std::vector<QuantisedRotation>(2), radii, 0, 0, {});
    const auto search = make_reference_search(reference);
    std::vector<LatticePoint> frame;
    for (const auto p : reference.mesh.positions) frame.push_back(p + LatticePoint{60, 40, -30});
    RegistrationOptions options;
    options.iterations = 60;
    options.point_to_plane = true;
    const std::vector<RigidMotion> none(2);
    const auto found = register_bones(search, frame, reference.sub_meshes, none, {}, options, {});
    for (std::size_t bone = 0; bone < 2; ++bone) {
        const Vector3d middle = real(reference.pivots[bone]);
        EXPECT_LT((found[bone](middle) - middle).norm(), 1000);
    }
}

TEST(BoneRegistration, StartsFromTheMotionBeforeWhereThatFitsBetter) {
    const auto reference = two_limbs();
    const auto search = make_reference_search(reference);
    RigidMotion far;
    far.shift = {0, 60000, 0};
    std::vector<LatticePoint> frame;
    for (const auto p : reference.mesh.positions) frame.push_back(p + LatticePoint{0, 60000, 0});
    const std::vector<RigidMotion> lost(2), before(2, far);
    const auto found = register_bones(search, frame, reference.sub_meshes, lost, before, {}, {});
    for (const auto& motion : found) EXPECT_LT((motion.shift - far.shift).norm(), 1.0);
}

TEST(BoneRegistration, ABoneWithTooFewVerticesKeepsItsSkeletalMotion) {
    const auto reference = two_limbs();
    const auto search = make_reference_search(reference);
    std::mt19937 random(5);
    const std::vector<RigidMotion> skeletal = {random_motion(random, 1, 500), random_motion(random, 1, 500)};
    const std::vector<LatticePoint> frame(11, LatticePoint{-8000, 0, 0});
    const auto sub_meshes = group_by_bone(std::vector<BoneIndex>(11, 0), 2);
    const auto found = register_bones(search, frame, sub_meshes, skeletal, {}, {}, {});
    for (std::size_t bone = 0; bone < 2; ++bone) {
        EXPECT_EQ(found[bone].rotation, skeletal[bone].rotation);
        EXPECT_EQ(found[bone].shift, skeletal[bone].shift);
    }
}

}  // namespace
}  // namespace htvm::internal
