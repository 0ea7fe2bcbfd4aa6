#include <gtest/gtest.h>

#include <cmath>

#include "htvm/encoder.hpp"

namespace htvm::internal {
namespace {

Skeleton one_bone() {
    Skeleton skeleton;
    skeleton.joint_names = {"low", "high"};
    skeleton.bones = {{0, 1}};
    return skeleton;
}

// The side of a cylinder of the given radius around the y axis, from y = 0 to y = 1000; no vertex on the axis.
Mesh cylinder(double radius) {
    Mesh mesh;
    for (int y = 0; y <= 1000; y += 50)
        for (int i = 0; i < 36; ++i) {
            const double turn = i * 3.14159265358979 / 18;
            mesh.positions.push_back({static_cast<float>(radius * std::cos(turn)), static_cast<float>(y),
                                      static_cast<float>(radius * std::sin(turn))});
        }
    return mesh;
}

const CalibrationOptions maximum = {.percentile = 100};  // as in the paper
const Pose standing = {{{0, 0, 0}, {0, 1000, 0}}, {}, {}};

TEST(Calibration, OfACylinderIsItsRadius) {
    const auto radii = calibrate(cylinder(123), one_bone(), standing);
    ASSERT_TRUE(radii.has_value());
    ASSERT_EQ(radii->size(), 1u);
    EXPECT_NEAR((*radii)[0], 123, 0.1);
}

TEST(Calibration, VerticesThatProjectOntoNoBoneDoNotCount) {
    auto mesh = cylinder(50);
    mesh.positions.push_back({900, 1001, 0});
    mesh.positions.push_back({900, -1, 0});
    EXPECT_NEAR((*calibrate(mesh, one_bone(), standing, maximum))[0], 50, 0.1);
    mesh.positions.push_back({900, 999, 0});
    EXPECT_NEAR((*calibrate(mesh, one_bone(), standing, maximum))[0], 900, 0.1);
}

TEST(Calibration, APercentileLeavesOutTheFarthest) {
    auto mesh = cylinder(50);
    mesh.positions.push_back({900, 500, 0});
    EXPECT_NEAR((*calibrate(mesh, one_bone(), standing, {.percentile = 99}))[0], 50, 0.1);
    EXPECT_NEAR((*calibrate(mesh, one_bone(), standing, {.percentile = 0}))[0], 50, 0.1);
}

TEST(Calibration, EachVertexCountsForTheBoneWhoseAxisIsNearest) {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b", "c", "d", "e", "f"};
    skeleton.bones = {{0, 1}, {2, 3}, {4, 5}};
    const Pose pose = {
        {{-200, 0, 0}, {-200, 1000, 0}, {200, 0, 0}, {200, 1000, 0}, {0, 5000, 0}, {0, 6000, 0}}, {}, {}};
    Mesh mesh;
    for (const auto& p : cylinder(40).positions) mesh.positions.push_back({p[0] - 200, p[1], p[2]});
    for (const auto& p : cylinder(70).positions) mesh.positions.push_back({p[0] + 200, p[1], p[2]});
    const auto radii = calibrate(mesh, skeleton, pose);
    ASSERT_TRUE(radii.has_value());
    EXPECT_NEAR((*radii)[0], 40, 0.1);
    EXPECT_NEAR((*radii)[1], 70, 0.1);
    EXPECT_EQ((*radii)[2], 0) << "nothing projects onto it";
}

TEST(Calibration, OfAnEmptyMeshIsZero) { EXPECT_EQ(*calibrate({}, one_bone(), standing), std::vector<double>{0}); }

TEST(Calibration, SaysWhatIsWrong) {
    const auto refused = [](const Result<std::vector<double>>& result, const char* what) {
        ASSERT_FALSE(result.has_value()) << what;
        EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
        EXPECT_NE(result.error().message.find(what), std::string::npos) << result.error().message;
    };
    refused(calibrate(cylinder(1), one_bone(), standing, {.percentile = 101}), "percentile");
    refused(calibrate(cylinder(1), one_bone(), standing, {.percentile = std::nan("")}), "percentile");
    refused(calibrate(cylinder(1), one_bone(), {{{0, 0, 0}}, {}, {}}), "joint");
    refused(calibrate(cylinder(1), one_bone(), {{{0, 0, 0}, {0, std::nan(""), 0}}, {}, {}}), "joint 1");
    auto broken = cylinder(1);
    broken.positions[3][0] = std::nanf("");
    refused(calibrate(broken, one_bone(), standing), "vertex 3");
}

}  // namespace
}  // namespace htvm::internal
