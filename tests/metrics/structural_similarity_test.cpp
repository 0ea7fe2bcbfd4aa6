#include "metrics/structural_similarity.h"

#include <gtest/gtest.h>

#include <functional>

namespace htvm {
namespace {

using Level = std::function<int(int x, int y, int channel)>;

Picture picture_of(int width, int height, const Level& level) {
    Picture out{width, height, {}, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c) out.rgb.push_back(static_cast<std::uint8_t>(level(x, y, c)));
            out.covered.push_back(1);
        }
    return out;
}

int texture(int x, int y, int c) { return (37 * x + 11 * y + 53 * c + x * y) % 256; }
int disturbed(int x, int y, int c) { return (37 * x + 11 * y + 53 * c + x * y + (13 * x + 29 * y + 7 * c) % 41) % 256; }

TEST(StructuralSimilarity, OfEqualPicturesIsOne) {
    const Picture picture = picture_of(16, 14, texture);
    const auto sums = structural_similarity(picture, picture);
    EXPECT_DOUBLE_EQ(mean_similarity(sums), 1);
    EXPECT_EQ(sums.pixels, 6u * 4u);  // the others' windows leave the picture
}

TEST(StructuralSimilarity, OfEvenGreysFollowsFromTheirLevelsAlone) {
    const auto grey = [](int level) { return picture_of(12, 12, [=](int, int, int) { return level; }); };
    constexpr double c1 = 6.5025;
    EXPECT_NEAR(mean_similarity(structural_similarity(grey(100), grey(150))),
                (2 * 100 * 150 + c1) / (100 * 100 + 150 * 150 + c1), 1e-6);
}

TEST(StructuralSimilarity, IsOfTheLuma) {
    // The luma of pure red is 76.245, that of this grey 76: the pictures are as good as equal.
    const Picture red = picture_of(11, 11, [](int, int, int c) { return c == 0 ? 255 : 0; });
    const Picture grey = picture_of(11, 11, [](int, int, int) { return 76; });
    EXPECT_NEAR(mean_similarity(structural_similarity(red, grey)), 1, 1e-5);
}

// The expected values are those of the formula, evaluated window by window by a Python script.
TEST(StructuralSimilarity, OfTexturesIsTheMeanOfTheFormula) {
    EXPECT_NEAR(mean_similarity(structural_similarity(picture_of(16, 14, texture), picture_of(16, 14, disturbed))),
                0.5609485526031817, 1e-6);
}

TEST(StructuralSimilarity, IsTakenAtThePixelsThatEitherPictureCovers) {
    Picture first = picture_of(16, 14, texture), second = picture_of(16, 14, disturbed);
    for (int y = 0; y < 14; ++y)
        for (int x = 0; x < 16; ++x) {
            const auto pixel = static_cast<std::size_t>(16 * y + x);
            first.covered[pixel] = (x + y) % 2 == 0;
            second.covered[pixel] = x == 7;
        }
    const auto sums = structural_similarity(first, second);
    EXPECT_EQ(sums.pixels, 14u);
    EXPECT_NEAR(mean_similarity(sums), 0.5610354899787657, 1e-6);
}

TEST(StructuralSimilarity, OfNothingIsOne) {
    Picture empty = picture_of(16, 14, texture);
    empty.covered.assign(empty.covered.size(), 0);
    EXPECT_EQ(structural_similarity(empty, empty).pixels, 0u);
    EXPECT_EQ(mean_similarity(structural_similarity(empty, empty)), 1);
    const Picture small = picture_of(10, 30, texture);  // no window fits
    EXPECT_EQ(structural_similarity(small, small).pixels, 0u);
    EXPECT_EQ(structural_similarity(Picture{}, Picture{}).pixels, 0u);
}

TEST(StructuralSimilarity, SeesATextureThatIsGoneBetterThanThePsnr) {
    // Both pictures are 20 levels off everywhere: one is brighter, the other one has lost its stripes.
    const auto stripes = [](int x) { return x % 4 < 2 ? 80 : 120; };
    const Picture original = picture_of(24, 24, [&](int x, int, int) { return stripes(x); });
    const Picture brighter = picture_of(24, 24, [&](int x, int, int) { return stripes(x) + 20; });
    const Picture smooth = picture_of(24, 24, [](int, int, int) { return 100; });
    EXPECT_GT(mean_similarity(structural_similarity(original, brighter)), 0.95);
    EXPECT_LT(mean_similarity(structural_similarity(original, smooth)), 0.2);
}

}  // namespace
}  // namespace htvm
