#include "io/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "io/image_samples.h"
#include "io/mesh_samples.h"

namespace htvm {
namespace {

using samples::gradient;
using testing::HasSubstr;

TEST(ImageFile, PngAndLosslessWebpAreReadExactly) {
    const Image image = gradient(13, 7);
    for (const auto& bytes : {*write_png_image(image), samples::webp_of(image)}) {
        const auto read = read_image(bytes);
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_EQ(read->width, 13);
        EXPECT_EQ(read->height, 7);
        EXPECT_EQ(read->rgb, image.rgb);
    }
}

TEST(ImageFile, JpegIsReadAsNearAsItsQuality) {
    const Image image = gradient(32, 16);
    const auto read = read_image(*write_jpeg_image(image, 98));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->rgb.size(), image.rgb.size());
    int worst = 0;
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
        worst = std::max(worst, std::abs(int{image.rgb[i]} - int{read->rgb[i]}));
    EXPECT_LE(worst, 10);
}

TEST(ImageFile, GreyBecomesColoured) {
    const std::vector<std::uint8_t> levels{0, 100, 255, 7};
    const auto read = read_image(samples::png_of(2, 2, PNG_FORMAT_GRAY, levels.data()));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->rgb, (std::vector<std::uint8_t>{0, 0, 0, 100, 100, 100, 255, 255, 255, 7, 7, 7}));
}

TEST(ImageFile, ColoursBelowATransparentPixelStay) {
    const std::vector<std::uint8_t> pixels{10, 20, 30, 0, 40, 50, 60, 255};
    const auto read = read_image(samples::png_of(2, 1, PNG_FORMAT_RGBA, pixels.data()));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->rgb, (std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60}));
}

TEST(ImageFile, CutOffImagesAreErrorsWhereverTheyEnd) {
    const Image image = gradient(24, 24);
    for (const auto& bytes : {*write_png_image(image), *write_jpeg_image(image), samples::webp_of(image)})
        for (const std::size_t size : {std::size_t{20}, bytes.size() / 2, bytes.size() - 20}) {
            const auto read = read_image(std::span(bytes).first(size));
            ASSERT_FALSE(read.has_value()) << "the first " << size << " of " << bytes.size() << " bytes";
            EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
            EXPECT_THAT(read.error().message, HasSubstr("damaged or cut off"));
        }
}

TEST(ImageFile, OnesThatAreTooLargeAreRefusedWithTheirSize) {
    const Image image = gradient(9, 5);
    for (const auto& bytes : {*write_png_image(image), *write_jpeg_image(image), samples::webp_of(image)}) {
        EXPECT_TRUE(read_image(bytes, 9).has_value());
        const auto read = read_image(bytes, 8);
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().kind, ErrorKind::limit);
        EXPECT_THAT(read.error().message, HasSubstr("9 x 5 pixels, more than 8 x 8; make it smaller"));
    }
}

TEST(ImageFile, SixteenBitsAreUnsupported) {
    const std::vector<std::uint16_t> pixels(3 * 4, 30000);
    const auto read = read_image(samples::png_of(2, 2, PNG_FORMAT_LINEAR_RGB, pixels.data()));
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::unsupported);
    EXPECT_THAT(read.error().message, HasSubstr("16 bits a channel, which is not read; save it with 8 bits"));
}

TEST(ImageFile, ColoursOfPrintingAreUnsupported) {
    std::vector<std::uint8_t> pixels(4 * 64, 90), bytes(tjBufSize(8, 8, TJSAMP_444));
    auto size = static_cast<unsigned long>(bytes.size());
    unsigned char* to = bytes.data();
    void* jpeg = tjInitCompress();
    ASSERT_EQ(tjCompress2(jpeg, pixels.data(), 8, 32, 8, TJPF_CMYK, &to, &size, TJSAMP_444, 90, TJFLAG_NOREALLOC), 0);
    tjDestroy(jpeg);
    const auto read = read_image(std::span(bytes).first(size));
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::unsupported);
    EXPECT_THAT(read.error().message, HasSubstr("CMYK"));
}

TEST(ImageFile, AnimationsAreUnsupported) {
    // The header of a WebP file with the flag of animations, 4 x 4 pixels.
    std::vector<std::uint8_t> bytes;
    for (const char c : std::string("RIFF\x16\0\0\0WEBPVP8X\x0a\0\0\0\x02\0\0\0\x03\0\0\x03\0\0", 30))
        bytes.push_back(static_cast<std::uint8_t>(c));
    const auto read = read_image(bytes);
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::unsupported);
    EXPECT_THAT(read.error().message, HasSubstr("is an animation"));
}

TEST(ImageFile, OtherFormatsAreNamed) {
    const auto gif = read_image(samples::bytes_of("GIF89a and so on"));
    ASSERT_FALSE(gif.has_value());
    EXPECT_THAT(gif.error().message, HasSubstr("no PNG, JPEG or WebP image; save it as one of them"));
    const auto empty = read_image({});
    ASSERT_FALSE(empty.has_value());
    EXPECT_THAT(empty.error().message, HasSubstr("empty"));
    const auto missing = read_image_file("/nowhere/tex.png");
    ASSERT_FALSE(missing.has_value());
    EXPECT_THAT(missing.error().message, HasSubstr("/nowhere/tex.png: there is no such file"));
}

}  // namespace
}  // namespace htvm
