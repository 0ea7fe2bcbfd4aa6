#include "core/image.h"

#include <gtest/gtest.h>

#include <limits>

namespace htvm {
namespace {

using internal::ImagePyramid;

Image grey_image(int width, int height, const std::vector<std::uint8_t>& levels) {
    Image image{width, height, {}};
    for (const auto level : levels) image.rgb.insert(image.rgb.end(), 3, level);
    return image;
}

float grey_at(const ImagePyramid& pyramid, float u, float v, std::size_t level = 0) {
    return pyramid.at(u, v, level)[0];
}

// The upper row is 10, 20, the lower 50, 90.
const Image four = grey_image(2, 2, {10, 20, 50, 90});

TEST(Image, CoordinatesBeginAtTheLowerLeftCorner) {
    const ImagePyramid pyramid(four);
    EXPECT_EQ(grey_at(pyramid, 0.25f, 0.75f), 10);  // the centres of the texels
    EXPECT_EQ(grey_at(pyramid, 0.75f, 0.75f), 20);
    EXPECT_EQ(grey_at(pyramid, 0.25f, 0.25f), 50);
    EXPECT_EQ(grey_at(pyramid, 0.75f, 0.25f), 90);
}

TEST(Image, BetweenTexelsColoursChangeLinearly) {
    const ImagePyramid pyramid(four);
    EXPECT_FLOAT_EQ(grey_at(pyramid, 0.5f, 0.75f), 15);
    EXPECT_FLOAT_EQ(grey_at(pyramid, 0.375f, 0.25f), 60);
    EXPECT_FLOAT_EQ(grey_at(pyramid, 0.5f, 0.5f), (10 + 20 + 50 + 90) / 4.0f);
}

TEST(Image, TheBorderGoesOnInsteadOfMixingWithTheOtherSide) {
    const ImagePyramid pyramid(four);
    EXPECT_EQ(grey_at(pyramid, 0, 1), 10);
    EXPECT_EQ(grey_at(pyramid, 1, 0), 90);
}

TEST(Image, CoordinatesBeyondOneRepeatTheImage) {
    const ImagePyramid pyramid(four);
    EXPECT_EQ(grey_at(pyramid, 3.25f, -1.25f), 10);
    EXPECT_EQ(grey_at(pyramid, -0.25f, 2.25f), 90);
    constexpr float largest = std::numeric_limits<float>::max();
    EXPECT_LE(grey_at(pyramid, largest, -largest), 90) << "any finite coordinate is allowed";
}

TEST(Image, EachLevelIsTheMeanOfFourTexels) {
    const Image image = grey_image(4, 2, {0, 4, 100, 100, 8, 12, 100, 200});
    const ImagePyramid pyramid(image);
    ASSERT_EQ(pyramid.levels(), 3u);
    EXPECT_EQ(grey_at(pyramid, 0.25f, 0.5f, 1), 6);
    EXPECT_EQ(grey_at(pyramid, 0.75f, 0.5f, 1), 125);
    EXPECT_EQ(grey_at(pyramid, 0.1f, 0.9f, 2), 66);  // of the two: 65.5, rounded
}

TEST(Image, OddSizesRepeatTheLastTexels) {
    const Image image = grey_image(3, 1, {10, 30, 50});
    const ImagePyramid pyramid(image);
    EXPECT_EQ(grey_at(pyramid, 0.25f, 0.5f, 1), 20);
    EXPECT_EQ(grey_at(pyramid, 0.75f, 0.5f, 1), 50);
}

TEST(Image, TheLevelIsTheOneNearestInSize) {
    const Image image = grey_image(16, 16, std::vector<std::uint8_t>(256));
    const ImagePyramid pyramid(image);
    EXPECT_EQ(pyramid.level_for(0), 0u);
    EXPECT_EQ(pyramid.level_for(1.4), 0u);
    EXPECT_EQ(pyramid.level_for(1.5), 1u);
    EXPECT_EQ(pyramid.level_for(4), 2u);
    EXPECT_EQ(pyramid.level_for(1e9), 4u);
}

}  // namespace
}  // namespace htvm
