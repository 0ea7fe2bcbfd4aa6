#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "codec/random_numbers.h"
#include "codec/reference/skinning.h"

namespace htvm::internal {
namespace {

using test::between;

QuantisedRotation random_rotation(std::mt19937& random) {
    QuantisedRotation out;
    out.largest = static_cast<std::uint8_t>(test::below(random, 4));
    for (auto& c : out.others) c = static_cast<std::int16_t>(between(random, -8192, 8192));
    return out;
}

LatticePoint random_point(std::mt19937& random, std::int32_t reach) {
    return {between(random, -reach, reach), between(random, -reach, reach), between(random, -reach, reach)};
}

Eigen::Matrix3d real(const QuantisedRotation& rotation) {
    std::array<double, 4> q{};
    for (std::size_t k = 0, other = 0; k < 4; ++k) q[k] = k == rotation.largest ? 8192 : rotation.others[other++];
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

Eigen::Vector3d real(LatticePoint p) { return {p.x * 1.0, p.y * 1.0, p.z * 1.0}; }

// Two bones side by side, the left one's vertices at x < 0.
ReferenceMesh two_bones() {
    LatticeMesh mesh;
    mesh.positions = {{-100, 0, 0}, {100, 0, 0}, {-120, 50, 0}, {-80, 100, 0}, {110, 80, 10}};
    mesh.normals = {{127, 0, 0}, {0, 127, 0}, {0, 0, 127}, {127, 0, 0}, {0, -127, 0}};
    const std::vector<std::int32_t> radii = {10, 10, 10};
    return make_reference(std::move(mesh), {{0, 1}, {2, 3}, {4, 4}},
                          {{-100, 0, 0}, {-100, 100, 0}, {100, 0, 0}, {100, 100, 0}, {9000, 9000, 9000}},
                          std::vector<QuantisedRotation>(3), radii, 0, 7, {});
}

TEST(ReferenceMesh, IsSkinnedAndItsPivotsAreTheSubMeshesMeans) {
    const auto reference = two_bones();
    EXPECT_EQ(reference.frame, 7u);
    EXPECT_EQ(reference.bone_of_vertex, (std::vector<BoneIndex>{0, 1, 0, 0, 1}));
    ASSERT_EQ(reference.pivots.size(), 3u);
    EXPECT_EQ(reference.pivots[0], (LatticePoint{-100, 50, 0}));
    EXPECT_EQ(reference.pivots[1], (LatticePoint{105, 40, 5}));
    EXPECT_EQ(reference.pivots[2], (LatticePoint{9000, 9000, 9000})) << "a bare bone turns about its first joint";
}

TEST(ReferenceMesh, OfNothingIsLegal) {
    const std::vector<std::int32_t> radii = {10};
    const auto reference = make_reference({}, {{0, 1}}, {{0, 0, 0}, {1, 1, 1}}, {{}}, radii, 0, 0, {});
    EXPECT_TRUE(predict_positions(reference, std::vector<QuantisedTransform>(1), {}).empty());
}

TEST(Prediction, TransformsThatDoNothingLeaveTheReference) {
    const auto reference = two_bones();
    const std::vector<QuantisedTransform> none(3);
    EXPECT_EQ(predict_positions(reference, none, {}), reference.mesh.positions);
    EXPECT_EQ(predict_normals(reference, none), reference.mesh.normals);
}

TEST(Prediction, EachBoneMovesItsOwnVerticesAboutItsPivot) {
    const auto reference = two_bones();
    std::vector<QuantisedTransform> transforms(3);
    transforms[0].rotation = quantise_rotation({1, 0, 0, 1});  // a quarter turn about z
    transforms[0].shift = {0, 0, 1000};
    const auto moved = predict_positions(reference, transforms, {});
    EXPECT_EQ(moved[0], (LatticePoint{-50, 50, 1000}));
    EXPECT_EQ(moved[2], (LatticePoint{-100, 30, 1000}));
    EXPECT_EQ(moved[1], reference.mesh.positions[1]);
    EXPECT_EQ(moved[4], reference.mesh.positions[4]);
    const auto normals = predict_normals(reference, transforms);
    EXPECT_EQ(normals[0], (QuantisedNormal{0, 127, 0}));
    EXPECT_EQ(normals[2], (QuantisedNormal{0, 0, 127}));
    EXPECT_EQ(normals[1], reference.mesh.normals[1]);
}

// The vertices of two_bones() in one strip, so that the bones share vertices.
ReferenceMesh two_bones_that_share() {
    auto reference = two_bones();
    reference.weights = {
        {{0, 1}, {3072, 1024}}, {{1, 0}, {2048 + 1, 2047}}, {{0}, {4096}}, {{0, 1}, {2048, 2048}}, {{1}, {4096}}};
    return reference;
}

TEST(Prediction, WeightsThatAreWholeChangeNothing) {
    std::mt19937 random(5);
    const auto rigid = two_bones();
    auto whole = rigid;
    for (const auto bone : rigid.bone_of_vertex) whole.weights.push_back({{bone}, {4096}});
    std::vector<QuantisedTransform> transforms(3);
    for (auto& t : transforms) t = {random_rotation(random), random_point(random, 1000)};
    EXPECT_EQ(predict_positions(whole, transforms, {}), predict_positions(rigid, transforms, {}));
    EXPECT_EQ(predict_normals(whole, transforms), predict_normals(rigid, transforms));
}

TEST(Prediction, SharedVerticesGoToTheWeightedMean) {
    const auto reference = two_bones_that_share();
    std::vector<QuantisedTransform> transforms(3);
    transforms[0].shift = {400, 0, 0};
    transforms[1].shift = {0, 800, 1};
    const auto moved = predict_positions(reference, transforms, {});
    EXPECT_EQ(moved[0], (LatticePoint{-100 + 300, 200, 0}));
    EXPECT_EQ(moved[3], (LatticePoint{-80 + 200, 100 + 400, 1})) << "halves are rounded up";
    EXPECT_EQ(moved[2], (LatticePoint{-120 + 400, 50, 0}));
    EXPECT_EQ(moved[4], (LatticePoint{110, 880, 11}));
    EXPECT_EQ(predict_normals(reference, transforms), reference.mesh.normals);
    transforms[0].rotation = transforms[1].rotation = quantise_rotation({1, 0, 0, 1});  // both a quarter turn about z
    EXPECT_EQ(predict_normals(reference, transforms)[0], (QuantisedNormal{0, 127, 0}));
}

TEST(Prediction, RoundsTheRealBlendOnce) {
    std::mt19937 random(6);
    for (int i = 0; i < 2000; ++i) {
        auto reference = two_bones_that_share();
        for (auto& p : reference.mesh.positions) p = random_point(random, 1 << 20);
        for (auto& p : reference.pivots) p = random_point(random, 1 << 20);
        std::vector<QuantisedTransform> transforms(3);
        for (auto& t : transforms) t = {random_rotation(random), random_point(random, 1 << 20)};
        const auto moved = predict_positions(reference, transforms, {});
        Eigen::Vector3d expected = Eigen::Vector3d::Zero();
        for (const std::size_t bone : {0, 1}) {
            const Eigen::Vector3d pivot = real(reference.pivots[bone]);
            expected += (bone == 0 ? 0.75 : 0.25) *
                        (real(transforms[bone].rotation) * (real(reference.mesh.positions[0]) - pivot) + pivot +
                         real(transforms[bone].shift));
        }
        ASSERT_LT((real(moved[0]) - expected).cwiseAbs().maxCoeff(), 0.75) << "a half and the matrix's own rounding";
    }
}

TEST(Prediction, OfSharedVerticesNeverLeavesTheLattice) {
    std::mt19937 random(7);
    auto corner = [&](std::int32_t reach) {
        auto c = [&] { return test::below(random, 2) ? reach : -reach; };
        return LatticePoint{c(), c(), c()};
    };
    for (int i = 0; i < 5000; ++i) {
        auto reference = two_bones_that_share();
        for (auto& p : reference.mesh.positions) p = corner(lattice_limit);
        for (auto& p : reference.pivots) p = corner(lattice_limit);
        std::vector<QuantisedTransform> transforms(3);
        for (auto& t : transforms)
            t = {random_rotation(random), corner(2 * lattice_limit)};  // the largest that a
                                                                       // stream can hold
        const auto moved = predict_positions(reference, transforms, {});
        for (const auto p : moved) ASSERT_TRUE(on_lattice(p));
        // If the sum overflowed, it would end up on the other side.
        const double x =
            0.75 * (real(transforms[0].rotation) * real(reference.mesh.positions[0] - reference.pivots[0]) +
                    real(reference.pivots[0]) + real(transforms[0].shift))
                       .x() +
            0.25 * (real(transforms[1].rotation) * real(reference.mesh.positions[0] - reference.pivots[1]) +
                    real(reference.pivots[1]) + real(transforms[1].shift))
                       .x();
        ASSERT_NEAR(moved[0].x, std::clamp(x, -1.0 * lattice_limit, 1.0 * lattice_limit), 8);
    }
}

TEST(ReferenceMesh, OfSomeWidthHasWeightsWhereItsBonesMeet) {
    LatticeMesh mesh;
    mesh.positions = {{-100, 0, 0}, {100, 0, 0}, {0, 90, 0}, {0, -200, 0}};
    mesh.triangles = {{0, 1, 2}};
    const std::vector<std::int32_t> radii = {1, 1};
    const auto make = [&](std::int32_t width) {
        return make_reference(mesh, {{0, 1}, {2, 3}}, {{-100, -9, 0}, {-100, 200, 0}, {100, -9, 0}, {100, 200, 0}},
                              std::vector<QuantisedRotation>(2), radii, width, 0, {});
    };
    EXPECT_TRUE(make(0).weights.empty());
    const auto reference = make(1000);
    ASSERT_EQ(reference.weights.size(), 4u);
    EXPECT_EQ(reference.weights, smooth_weights(reference.bone_of_vertex, mesh.positions, mesh.triangles, 1000, {}));
    EXPECT_GT(reference.weights[0].weight[1], 0);
    EXPECT_EQ(reference.weights[3].weight[0], 4096);
}

TEST(Move, IsTheRealRotationToWithinALatticeUnit) {
    std::mt19937 random(1);
    for (int i = 0; i < 20000; ++i) {
        const auto rotation = random_rotation(random);
        const auto point = random_point(random, 1 << 20), pivot = random_point(random, 1 << 20);
        const auto shift = random_point(random, 1 << 20);
        const auto moved = move(point, rotation_matrix(rotation), pivot, shift);
        const Eigen::Vector3d expected = real(rotation) * (real(point) - real(pivot)) + real(pivot) + real(shift);
        ASSERT_LT((real(moved) - expected).cwiseAbs().maxCoeff(), 1.0);
    }
}

TEST(Move, NeverLeavesTheLattice) {
    std::mt19937 random(2);
    for (int i = 0; i < 5000; ++i) {
        auto corner = [&] {
            auto c = [&] { return test::below(random, 2) ? lattice_limit : -lattice_limit; };
            return LatticePoint{c(), c(), c()};
        };
        const auto shift = corner() + corner();  // the largest that a stream can hold
        EXPECT_TRUE(on_lattice(move(corner(), rotation_matrix(random_rotation(random)), corner(), shift)));
    }
}

TEST(Prediction, IsTheSameForAnyNumberOfThreads) {
    std::mt19937 random(3);
    LatticeMesh mesh;
    for (int i = 0; i < 50000; ++i) mesh.positions.push_back(random_point(random, 5000));
    const std::vector<std::int32_t> radii = {100, 100};
    const auto reference = make_reference(std::move(mesh), {{0, 1}, {1, 2}}, {{0, 0, 0}, {0, 999, 0}, {999, 0, 0}},
                                          std::vector<QuantisedRotation>(2), radii, 0, 0, ThreadPool(3));
    const std::vector<QuantisedTransform> transforms = {{random_rotation(random), {5, 6, 7}},
                                                        {random_rotation(random), {-5, 6, 700}}};
    EXPECT_EQ(predict_positions(reference, transforms, {}), predict_positions(reference, transforms, ThreadPool(7)));
}

}  // namespace
}  // namespace htvm::internal
