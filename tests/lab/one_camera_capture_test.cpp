// The stand-in for the paper's capture by one depth camera.
#include "one_camera_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace htvm::lab {
namespace {

TEST(OneCameraCapture, HasAnOpenMeshATrackedAndATruePoseForEveryFrame) {
    const auto made = one_camera_capture(2, {}, {});
    ASSERT_TRUE(made.has_value());
    ASSERT_EQ(made->source.size(), 2u);
    ASSERT_EQ(made->true_poses.size(), 2u);
    EXPECT_EQ(made->source.facts().skeleton.bones.size(), 14u);
    EXPECT_EQ(made->key, "2 frames of calm motion before one kinect, seed 1");
    for (std::size_t i = 0; i < 2; ++i) {
        const auto frame = made->source.frame(i);
        ASSERT_TRUE(frame.has_value());
        EXPECT_GT((*frame)->mesh.positions.size(), 8000u);
        const auto [low, high] =
            std::ranges::minmax((*frame)->mesh.positions, {}, [](const Vector3f& p) { return p[2]; });
        EXPECT_LT(high[2] - low[2], 450) << "the front alone, and the feet";
        ASSERT_TRUE((*frame)->pose.has_value());
        EXPECT_NE((*frame)->pose->joints, made->true_poses[i].joints) << "the tracker's noise";
        EXPECT_EQ((*frame)->timestamp_us, i == 0 ? 0 : 33333);
    }
    const auto box = made->source.facts().box;
    EXPECT_GT(box.high[1] - box.low[1], 1650);
    EXPECT_GT(made->source.facts().frame_side, 1650);
}

}  // namespace
}  // namespace htvm::lab
