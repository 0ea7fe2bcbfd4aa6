#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "codec/reference/transforms.h"

namespace htvm::internal {
namespace {

Eigen::Quaterniond random_quaternion(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
}

QuantisedRotation quantised(const Eigen::Quaterniond& q) { return quantise_rotation({q.w(), q.x(), q.y(), q.z()}); }

Eigen::Matrix3d real(const RotationMatrix& m) {
    Eigen::Matrix3d out;
    for (int i = 0; i < 9; ++i) out(i / 3, i % 3) = static_cast<double>(m[static_cast<std::size_t>(i)]) / (1 << 24);
    return out;
}

TEST(QuantisedRotation, NoneIsTheIdentity) {
    const auto m = rotation_matrix({});
    constexpr std::int64_t one = std::int64_t{1} << matrix_bits;
    EXPECT_EQ(m, (RotationMatrix{one, 0, 0, 0, one, 0, 0, 0, one}));
    EXPECT_EQ(rotate(m, {5, -7, 1 << 24}), (LatticePoint{5, -7, 1 << 24}));
}

TEST(QuantisedRotation, IsWithinTwoQuantaOfTheRotation) {
    // Each of three components is off by at most half of 2^-13, relative to a largest component of 1: at most sqrt(3)
    // 2^-13 rad.
    std::mt19937 random(1);
    for (int i = 0; i < 20000; ++i) {
        const auto q = random_quaternion(random);
        const Eigen::Quaterniond back(real(rotation_matrix(quantised(q))));
        EXPECT_LT(q.angularDistance(back), std::sqrt(3.0) / 8192 + 1e-6);
    }
}

TEST(QuantisedRotation, TheSignAndLengthOfTheQuaternionDoNotMatter) {
    std::mt19937 random(2);
    for (int i = 0; i < 1000; ++i) {
        const auto q = random_quaternion(random);
        const auto a = quantise_rotation({q.w(), q.x(), q.y(), q.z()});
        EXPECT_EQ(a, quantise_rotation({-q.w(), -q.x(), -q.y(), -q.z()}));
        EXPECT_EQ(a, quantise_rotation({4 * q.w(), 4 * q.x(), 4 * q.y(), 4 * q.z()}));
        EXPECT_LT(a.largest, 4);
        for (const auto c : a.others) EXPECT_LE(std::abs(c), 1 << rotation_bits);
    }
}

TEST(QuantisedRotation, QuarterTurnsAreExact) {
    const auto m = rotation_matrix(quantise_rotation({1, 0, 0, 1}));  // about z
    EXPECT_EQ(rotate(m, {1000, 10, 3}), (LatticePoint{-10, 1000, 3}));
    const auto half = rotation_matrix(quantise_rotation({0, 1, 0, 0}));  // 180 degrees about x
    EXPECT_EQ(rotate(half, {1, 2, 3}), (LatticePoint{1, -2, -3}));
}

TEST(QuantisedRotation, EveryMatrixIsOrthonormal) {
    std::mt19937 random(3);
    for (int i = 0; i < 5000; ++i) {
        QuantisedRotation r;
        r.largest = static_cast<std::uint8_t>(i % 4);
        for (auto& c : r.others) c = static_cast<std::int16_t>(static_cast<int>(random() % 16385) - 8192);
        const auto m = real(rotation_matrix(r));
        EXPECT_LT((m * m.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-6);
        EXPECT_NEAR(m.determinant(), 1, 1e-6);
    }
}

TEST(QuantisedRotation, TurnsAPointToWithinALatticeUnit) {
    std::mt19937 random(4);
    std::uniform_int_distribution<std::int32_t> coordinate(-(1 << 21), 1 << 21);  // 130 m at 1/16 mm
    for (int i = 0; i < 20000; ++i) {
        const auto rotation = quantised(random_quaternion(random));
        // Turned by the exact rotation of the quantised quaternion.
        std::array<double, 4> q{};
        for (std::size_t k = 0, other = 0; k < 4; ++k) q[k] = k == rotation.largest ? 8192 : rotation.others[other++];
        const Eigen::Matrix3d exact = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
        const LatticePoint v{coordinate(random), coordinate(random), coordinate(random)};
        const auto turned = rotate(rotation_matrix(rotation), v);
        const Eigen::Vector3d expected = exact * Eigen::Vector3d(v.x, v.y, v.z);
        EXPECT_LT((Eigen::Vector3d(turned.x, turned.y, turned.z) - expected).cwiseAbs().maxCoeff(), 1.0);
    }
}

TEST(QuantisedRotation, TheFarthestPointsDoNotOverflow) {
    std::mt19937 random(5);
    constexpr std::int32_t far = 2 * lattice_limit;  // a difference of two lattice points
    for (int i = 0; i < 2000; ++i) {
        const auto m = rotation_matrix(quantised(random_quaternion(random)));
        const LatticePoint v{i & 1 ? far : -far, i & 2 ? far : -far, i & 4 ? far : -far};
        const auto turned = rotate(m, v);
        const double length = Eigen::Vector3d(turned.x, turned.y, turned.z).norm();
        EXPECT_NEAR(length, std::sqrt(3.0) * far, 8);
    }
}

}  // namespace
}  // namespace htvm::internal
