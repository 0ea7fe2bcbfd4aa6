// How a bitrate is shared between meshes and pictures, over several passes.
#include "rate_sharing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace htvm::app {
namespace {

// A capture whose meshes and pictures take so many bits at a quality, the meshes within what they are given.
struct Taken {
    double mesh_bits_at_0 = 1e4, mesh_slope = 0.08, picture_bits_at_0 = 2e4, picture_slope = 0.045;
    double drawn_slope = 0;  // by which pictures have more bits on finer meshes
    SharedPass code(double picture_quality, double mesh_bits) const {
        const double quality = std::clamp(std::log2(mesh_bits / mesh_bits_at_0) / mesh_slope, 0.0, 100.0);
        return {quality, mesh_bits_at_0 * std::exp2(mesh_slope * quality), picture_quality,
                picture_bits_at_0 * std::exp2(picture_slope * picture_quality + drawn_slope * quality)};
    }
};

// Passes until the rate is met, of eight; the last one.
SharedPass share(const Taken& capture, double wanted, int& passes) {
    RateSharing sharing(wanted);
    auto pass = capture.code(40, wanted / 2);
    for (passes = 1;; ++passes) {
        sharing.add(pass);
        if (sharing.is_met() || sharing.is_finest() || passes == 8) return pass;
        const auto next = sharing.next();
        pass = capture.code(next.picture_quality, next.mesh_bits);
    }
}

TEST(RateSharing, MeetsTheRateWithMeshesAndPicturesAlike) {
    for (const double wanted : {1e5, 3e5, 1e6, 2e6}) {
        int passes = 0;
        const auto last = share({}, wanted, passes);
        EXPECT_NEAR(last.bits() / wanted, 1, 0.05) << wanted;
        EXPECT_NEAR(last.mesh_quality, last.picture_quality, 8) << wanted;
        EXPECT_LE(passes, 4) << wanted;
    }
}

TEST(RateSharing, NearTheRatePicturesStayAndMeshesTakeTheRest) {
    RateSharing sharing(1e6);
    sharing.add({57, 4e5, 55, 5.2e5});
    EXPECT_FALSE(sharing.is_met());
    EXPECT_EQ(sharing.next().picture_quality, 55);
    EXPECT_EQ(sharing.next().mesh_bits, 4.8e5);
}

TEST(RateSharing, WherePicturesKeepTheirQualityTheMeshesHaveWhatTheLastTwoPassesTell) {
    RateSharing sharing(9e5);
    sharing.add({69, 2.52e5, 62, 7.09e5});
    EXPECT_EQ(sharing.next().mesh_bits, 9e5 - 7.09e5);
    sharing.add({56, 1.92e5, 62, 6.49e5});  // 1.2e5 less of all for 0.6e5 less of meshes
    EXPECT_EQ(sharing.next().picture_quality, 62);
    EXPECT_NEAR(sharing.next().mesh_bits, 1.92e5 + 0.59e5 / 2, 1);
}

TEST(RateSharing, MeetsTheRateWherePicturesHaveMoreBitsOnFinerMeshes) {
    Taken capture;
    capture.drawn_slope = 0.01;
    for (const double wanted : {1e5, 3e5, 1e6}) {
        int passes = 0;
        EXPECT_NEAR(share(capture, wanted, passes).bits() / wanted, 1, 0.05) << wanted;
    }
}

TEST(RateSharing, PicturesTakeWhatMeshesAtTheirFinestLeave) {
    int passes = 0;
    Taken capture;
    capture.mesh_slope = 0.03;
    const auto last = share(capture, 7e5, passes);
    EXPECT_EQ(last.mesh_quality, 100);
    EXPECT_GT(last.picture_quality, 100);
    EXPECT_NEAR(last.bits() / 7e5, 1, 0.05);
}

TEST(RateSharing, GivesUpWhereAllIsAtItsFinest) {
    RateSharing sharing(1e9);
    sharing.add({100, 1e6, finest_picture_quality, 1e6});
    EXPECT_TRUE(sharing.is_finest());
    EXPECT_FALSE(sharing.is_met());
}

TEST(RateSharing, IsNotMetWhereOneOfTheTwoHasAllOfIt) {
    RateSharing sharing(1e6);
    sharing.add({20, 1e5, 80, 9e5});
    EXPECT_FALSE(sharing.is_met());
    const auto next = sharing.next();
    EXPECT_LT(next.picture_quality, 80);
    EXPECT_GT(next.mesh_bits, 1e5);
}

}  // namespace
}  // namespace htvm::app
