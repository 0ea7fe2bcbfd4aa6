#include "metrics/cloud_psnr.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrics/shapes.h"

namespace htvm {
namespace {

TEST(CloudPsnr, OfAPlaneRaisedByOneMillimetreIsThePeakSquaredInDecibels) {
    const CloudError error = cloud_error(shapes::plane(1000, 10, 0), shapes::plane(1000, 10, 1));
    EXPECT_NEAR(d1_psnr(error, 1000), 60, 1e-9);
    EXPECT_NEAR(d2_psnr(error, 1000), 60, 1e-9);
}

TEST(CloudPsnr, SlidingAlongTheSurfaceCostsD1ButNotD2) {
    const CloudError error =
        cloud_error(shapes::plane(1000, 10, 0), shapes::moved(shapes::plane(1000, 10, 0), 10, 0, 0));
    EXPECT_NEAR(d1_psnr(error, 1000), 40, 1e-9);
    EXPECT_TRUE(std::isinf(d2_psnr(error, 1000)));
}

TEST(CloudPsnr, TheMeshesOwnNormalsComeFirst) {
    const Mesh flat = shapes::plane(1000, 10, 0);
    Mesh slid = shapes::moved(flat, 10, 0, 0);
    slid.normals.assign(slid.positions.size(), {1, 0, 0});
    EXPECT_NEAR(cloud_error(flat, slid).forward.squared_plane, 121 * 100.0, 1e-6);
    EXPECT_NEAR(cloud_error(flat, slid).backward.squared_plane, 0, 1e-9);
}

TEST(CloudPsnr, WithoutTrianglesOrNormalsD2CountsTheWholeDistance) {
    Mesh a, b;
    a.positions = {{0, 0, 0}};
    b.positions = {{3, 4, 0}};
    EXPECT_DOUBLE_EQ(d1_error(cloud_error(a, b)), 25);
    EXPECT_DOUBLE_EQ(d2_error(cloud_error(a, b)), 25);
}

TEST(CloudPsnr, OfEqualMeshesIsInfiniteAndAgainstNothingMinusInfinite) {
    const Mesh mesh = shapes::sphere(100, 2);
    EXPECT_EQ(d1_psnr(cloud_error(mesh, mesh), 100), std::numeric_limits<double>::infinity());
    EXPECT_EQ(d1_psnr(cloud_error(mesh, Mesh{}), 100), -std::numeric_limits<double>::infinity());
}

TEST(CloudPsnr, TheWorseDirectionCountsAndFramesAddUp) {
    Mesh one, two;
    one.positions = {{0, 0, 0}};
    two.positions = {{0, 0, 0}, {10, 0, 0}};
    CloudError sums = cloud_error(one, two);
    EXPECT_DOUBLE_EQ(d1_error(sums), 50);
    sums += cloud_error(two, two);
    EXPECT_DOUBLE_EQ(d1_error(sums), 25);
}

}  // namespace
}  // namespace htvm
