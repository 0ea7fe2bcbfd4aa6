#include "surface/rigid_registration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <vector>

namespace htvm::internal {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3f;

RigidMotion motion(double angle, const Vector3d& axis, const Vector3d& shift) {
    return {Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(), shift};
}

std::vector<Vector3d> cloud(std::size_t count, std::mt19937& random) {
    std::normal_distribution<double> spread(0, 300);
    std::vector<Vector3d> out;
    for (std::size_t i = 0; i < count; ++i) out.emplace_back(spread(random), spread(random), spread(random));
    return out;
}

void expect_near(const RigidMotion& a, const RigidMotion& b, double turn, double shift) {
    EXPECT_LT((a.rotation - b.rotation).norm(), turn);
    EXPECT_LT((a.shift - b.shift).norm(), shift);
    EXPECT_NEAR(a.rotation.determinant(), 1, 1e-9);
    EXPECT_LT((a.rotation * a.rotation.transpose() - Matrix3d::Identity()).norm(), 1e-9);
}

TEST(RigidMotion, IsUndoneByItsInverse) {
    const auto m = motion(2.1, {1, 2, 3}, {100, -50, 7});
    const Vector3d x(4, 5, 6);
    EXPECT_LT((m.inverse()(m(x)) - x).norm(), 1e-9);
    EXPECT_LT((m(m.inverse()(x)) - x).norm(), 1e-9);
}

TEST(Align, RecoversAnyMotionFromExactPairs) {
    std::mt19937 random(1);
    for (const double angle : {0.0, 0.1, 1.0, 3.0, 3.14159})
        for (const std::size_t count : {3u, 4u, 100u}) {
            const auto from = cloud(count, random);
            const auto truth = motion(angle, {-1, 0.5, 2}, {1000, 20, -300});
            std::vector<Vector3d> to;
            for (const auto& x : from) to.push_back(truth(x));
            expect_near(align(from, to), truth, 1e-5, 1e-2);
        }
}

TEST(Align, DoesNotMirror) {
    std::mt19937 random(2);
    const auto from = cloud(20, random);
    std::vector<Vector3d> to;
    for (const auto& x : from) to.emplace_back(-x.x(), x.y(), x.z());
    EXPECT_NEAR(align(from, to).rotation.determinant(), 1, 1e-9);
}

TEST(Align, OnePairOnlyShifts) {
    const std::vector<Vector3d> from = {{1, 2, 3}}, to = {{11, 0, 3}};
    const auto found = align(from, to);
    EXPECT_LT((found.rotation - Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_LT((found.shift - Vector3d(10, -2, 0)).norm(), 1e-9);
}

TEST(Align, PointsInOneLineDoNotTurnAboutIt) {
    std::vector<Vector3d> line, moved;
    for (int i = 0; i < 10; ++i) {
        line.emplace_back(10 * i, 0, 0);
        moved.emplace_back(10 * i + 5, 1, 2);
    }
    EXPECT_LT((align(line, moved).rotation - Matrix3d::Identity()).norm(), 1e-6);
}

TEST(Align, PointsInOnePlaceOnlyShift) {
    const std::vector<Vector3d> from(5, Vector3d(1, 1, 1)), to(5, Vector3d(2, 3, 4));
    const auto found = align(from, to);
    EXPECT_LT((found.rotation - Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_LT((found(from[0]) - to[0]).norm(), 1e-9);
}

// An ellipsoid with three different axes, so that every turn changes it; with its normals.
struct Body {
    std::vector<Point3f> points;
    std::vector<Vector3f> normals;
};
Body ellipsoid(std::size_t count) {
    Body out;
    for (std::size_t i = 0; i < count; ++i) {
        const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count);
        const double turn = 2.39996323 * static_cast<double>(i), r = std::sqrt(1 - z * z);
        const Vector3f p(static_cast<float>(300 * r * std::cos(turn)), static_cast<float>(180 * r * std::sin(turn)),
                         static_cast<float>(600 * z));
        out.points.push_back({p.x(), p.y(), p.z()});
        out.normals.push_back(
            Vector3f(p.x() / (300.f * 300.f), p.y() / (180.f * 180.f), p.z() / (600.f * 600.f)).normalized());
    }
    return out;
}

std::vector<Point3f> moved(const std::vector<Point3f>& points, const RigidMotion& by) {
    std::vector<Point3f> out;
    for (const auto& p : points) {
        const Vector3f x = by(Vector3d(p[0], p[1], p[2])).cast<float>();
        out.push_back({x.x(), x.y(), x.z()});
    }
    return out;
}

const RigidMotion small_motion = motion(0.03, {1, 1, -1}, {4, -6, 5});

TEST(Registration, FindsASmallMotion) {
    const auto body = ellipsoid(3000);
    RegistrationOptions options;
    options.iterations = 60;
    options.trim = 0;
    for (const bool planes : {false, true}) {
        options.point_to_plane = planes;
        const auto found =
            register_points(NearestPoints(body.points), body.normals, moved(body.points, small_motion), {}, options);
        SCOPED_TRACE(planes ? "planes" : "points");
        expect_near(found, small_motion, 0.01, 2.5);
    }
}

TEST(Registration, OutliersAreTrimmed) {
    const auto body = ellipsoid(3000);
    auto frame = moved(body.points, small_motion);
    for (std::size_t i = 0; i < frame.size(); i += 7) frame[i][0] += 900;  // a mis-skinned arm
    RegistrationOptions options;
    options.iterations = 60;
    options.samples = 3000;
    options.trim = 0.2;  // more than the share of outliers, a seventh
    const auto trimmed = register_points(NearestPoints(body.points), {}, frame, {}, options);
    expect_near(trimmed, small_motion, 0.01, 2.5);
    options.trim = 0;
    const auto pulled = register_points(NearestPoints(body.points), {}, frame, {}, options);
    EXPECT_GT((pulled.shift - small_motion.shift).norm(), 10.0);
}

TEST(Registration, FromTheTruthItStays) {
    const auto body = ellipsoid(1000);
    const auto truth = motion(1.2, {0, 1, 0}, {500, 0, 100});
    for (const bool planes : {false, true}) {
        RegistrationOptions options;
        options.point_to_plane = planes;
        const auto found =
            register_points(NearestPoints(body.points), body.normals, moved(body.points, truth), truth, options);
        expect_near(found, truth, 1e-3, 0.2);
    }
}

TEST(Registration, TooFewPointsOnEitherSideKeepTheStart) {
    const auto body = ellipsoid(100);
    const auto few = std::vector<Point3f>(body.points.begin(), body.points.begin() + 11);
    const auto start = motion(0.5, {0, 0, 1}, {1, 2, 3});
    const auto expect_start = [&](const RigidMotion& found) {
        EXPECT_EQ(found.rotation, start.rotation);
        EXPECT_EQ(found.shift, start.shift);
    };
    expect_start(register_points(NearestPoints(few), {}, body.points, start, {}));
    expect_start(register_points(NearestPoints(body.points), {}, few, start, {}));
    expect_start(register_points(NearestPoints({}), {}, {}, start, {}));
}

TEST(Registration, PointsAllInOnePlaceGiveAMotion) {
    const std::vector<Point3f> one(50, Point3f{1, 2, 3}), other(50, Point3f{4, 2, 3});
    for (const bool planes : {false, true}) {
        RegistrationOptions options;
        options.point_to_plane = planes;
        const std::vector<Vector3f> no_normals(50, Vector3f::Zero());
        const auto found = register_points(NearestPoints(one), no_normals, other, {}, options);
        EXPECT_TRUE(found.rotation.allFinite());
        EXPECT_TRUE(found.shift.allFinite());
    }
}

TEST(Registration, ErrorIsTheMeanSquareOfTheNearest) {
    const std::vector<Point3f> reference = {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}, {0, 0, 100}};
    const std::vector<Point3f> frame = {{1, 0, 0}, {102, 0, 0}, {0, 103, 0}, {0, 0, 400}};
    RegistrationOptions options;
    options.trim = 0.25;
    EXPECT_FLOAT_EQ(static_cast<float>(registration_error(NearestPoints(reference), frame, {}, options)),
                    (1.f + 4.f + 9.f) / 3.f);
    EXPECT_EQ(registration_error(NearestPoints({}), frame, {}, options), 0);
    EXPECT_EQ(registration_error(NearestPoints(reference), {}, {}, options), 0);
}

}  // namespace
}  // namespace htvm::internal
