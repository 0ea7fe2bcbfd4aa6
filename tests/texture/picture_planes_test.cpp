// Red, green, blue to planes and back.
#include "htvm/picture_planes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace htvm {
namespace {

Image filled(int width, int height, std::array<std::uint8_t, 3> colour) {
    Image out{width, height, {}};
    for (int i = 0; i < width * height; ++i) out.rgb.insert(out.rgb.end(), colour.begin(), colour.end());
    return out;
}

std::array<int, 3> planes_of(std::array<std::uint8_t, 3> colour, ColourMatrix matrix, bool full_range) {
    const OwnPlanes planes(filled(2, 2, colour), matrix, full_range);
    const auto view = planes.view();
    return {view.samples[0][0], view.samples[1][0], view.samples[2][0]};
}

using Levels = std::array<int, 3>;

// ITU-R BT.709 and BT.601, with 219 and 224 levels, and with 255.
TEST(PicturePlanes, HaveTheLevelsOfTheStandards) {
    using enum ColourMatrix;
    EXPECT_EQ(planes_of({0, 0, 0}, bt709, false), (Levels{16, 128, 128}));
    EXPECT_EQ(planes_of({255, 255, 255}, bt709, false), (Levels{235, 128, 128}));
    EXPECT_EQ(planes_of({255, 0, 0}, bt709, false), (Levels{63, 102, 240}));
    EXPECT_EQ(planes_of({0, 255, 0}, bt709, false), (Levels{173, 42, 26}));
    EXPECT_EQ(planes_of({0, 0, 255}, bt709, false), (Levels{32, 240, 118}));
    EXPECT_EQ(planes_of({255, 0, 0}, bt601, false), (Levels{81, 90, 240}));
    EXPECT_EQ(planes_of({255, 255, 255}, bt601, true), (Levels{255, 128, 128}));
    EXPECT_EQ(planes_of({255, 0, 0}, bt601, true), (Levels{76, 85, 255}));
}

TEST(PicturePlanes, GreyHasNoColourAndComesBackWithinALevel) {
    for (int grey = 0; grey <= 255; ++grey) {
        const auto level = static_cast<std::uint8_t>(grey);
        const auto image = filled(4, 4, {level, level, level});
        const OwnPlanes planes(image);
        EXPECT_EQ(planes.view().samples[1][0], 128);
        EXPECT_EQ(planes.view().samples[2][3], 128);
        const auto back = image_of(planes.view());
        for (const auto value : back.rgb) EXPECT_NEAR(value, grey, 1) << grey;
    }
}

TEST(PicturePlanes, FlatColoursComeBackWithinTheRoundingOfTheLevels) {
    for (const bool full_range : {false, true})
        for (const auto matrix : {ColourMatrix::bt709, ColourMatrix::bt601})
            for (int r = 0; r <= 255; r += 51)
                for (int g = 0; g <= 255; g += 51)
                    for (int b = 0; b <= 255; b += 51) {
                        const std::array<std::uint8_t, 3> colour = {
                            static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b)};
                        const auto back = image_of(OwnPlanes(filled(3, 5, colour), matrix, full_range).view());
                        for (std::size_t i = 0; i < back.rgb.size(); ++i) EXPECT_NEAR(back.rgb[i], colour[i % 3], 2);
                    }
}

// A sample of chroma lies in the middle of its four pixels: the mean goes in, and pixels nearer to a sample have more
// of it.
TEST(PicturePlanes, ChromaLiesInTheMiddleOfFourPixels) {
    Image image = filled(8, 2, {128, 128, 128});
    for (int y = 0; y < 2; ++y)
        for (int x = 4; x < 8; ++x) {
            image.rgb[static_cast<std::size_t>(3 * (8 * y + x))] = 192;
            image.rgb[static_cast<std::size_t>(3 * (8 * y + x) + 1)] = 109;  // luma stays
        }
    const OwnPlanes planes(image);
    const auto view = planes.view();
    EXPECT_EQ(view.samples[2][0], 128);
    EXPECT_EQ(view.samples[2][1], 128);
    EXPECT_GT(view.samples[2][2], 150);
    const auto back = image_of(view);
    const auto red = [&](int x) { return static_cast<int>(back.rgb[static_cast<std::size_t>(3 * x)]); };
    EXPECT_NEAR(red(2), 128, 2);
    EXPECT_NEAR(red(5), 192, 3);
    EXPECT_NEAR(red(3) - red(2), (red(5) - red(2)) / 4, 2);
    EXPECT_NEAR(red(4) - red(2), 3 * (red(5) - red(2)) / 4, 2);
}

TEST(PicturePlanes, OddSidesAreRoundedUpWithTheLastPixelsRepeated) {
    Image image = filled(3, 3, {0, 0, 0});
    for (std::size_t k = 0; k < 3; ++k) image.rgb[3 * 8 + k] = k == 2 ? 255 : 0;  // the last pixel is blue
    const OwnPlanes planes(image);
    const auto view = planes.view();
    EXPECT_EQ(view.strides[1], 2);
    EXPECT_EQ(view.samples[1][0], 128);
    EXPECT_EQ(view.samples[1][3], 240);
    EXPECT_EQ(image_of(view).rgb.size(), image.rgb.size());
}

TEST(PicturePlanes, GainsMultiplyWhatIsShown) {
    const OwnPlanes planes(filled(2, 2, {100, 100, 100}));
    const auto image = image_of(planes.view(), {picture_gain_one * 2, picture_gain_one / 2, picture_gain_one * 4});
    EXPECT_NEAR(image.rgb[0], 200, 2);
    EXPECT_NEAR(image.rgb[1], 50, 1);
    EXPECT_EQ(image.rgb[2], 255);
}

}  // namespace
}  // namespace htvm
