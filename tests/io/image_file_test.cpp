#include "io/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <tuple>

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

TEST(ImageFile, OnesCutOffEarlyAreErrors) {
    const Image image = gradient(24, 24);
    for (const auto& bytes : {*write_png_image(image), *write_jpeg_image(image), samples::webp_of(image)})
        for (const std::size_t size : {std::size_t{20}, bytes.size() / 2}) {
            const auto read = read_image(std::span(bytes).first(size));
            ASSERT_FALSE(read.has_value()) << "the first " << size << " of " << bytes.size() << " bytes";
            EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
            EXPECT_THAT(read.error().message, HasSubstr("damaged or cut off"));
        }
}

// Pixels that do not compress.
Image noise(int width, int height) {
    Image out{width, height, {}};
    std::uint32_t state = 1;
    for (int i = 0; i < 3 * width * height; ++i) {
        state = state * 1664525 + 1013904223;
        out.rgb.push_back(static_cast<std::uint8_t>(state >> 24));
    }
    return out;
}

TEST(ImageFile, OnesCutOffLateAreReadAndSaySo) {
    const Image image = noise(64, 64);
    // In tenths of its bytes: so that rows of a PNG, or of a JPEG's blocks, are missing whole.
    for (const auto& [bytes, late, early] :
         {std::tuple{*write_png_image(image), 8u, 4u}, {*write_jpeg_image(image), 6u, 2u}}) {
        std::string damage;
        const auto whole = read_image(bytes, 64, &damage);
        ASSERT_TRUE(whole.has_value());
        EXPECT_EQ(damage, "");
        const auto read = read_image(std::span(bytes).first(bytes.size() * late / 10), 64, &damage);
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_TRUE(std::equal(read->rgb.begin(), read->rgb.begin() + 3 * 64 * 28, whole->rgb.begin()));
        EXPECT_THAT(damage, testing::MatchesRegex("is cut off: the last [1-4][0-9] % of it are grey or black"));
        EXPECT_FALSE(read_image(std::span(bytes).first(bytes.size() * early / 10), 64, &damage).has_value());
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

TEST(ImageFile, SixteenBitsAreRounded) {
    // libpng writes these as linear light, with the gamma that says so.
    const std::vector<std::uint16_t> pixels{0, 65535, 32768};
    const auto read = read_image(samples::png_of(1, 1, PNG_FORMAT_LINEAR_RGB, pixels.data()));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->rgb, (std::vector<std::uint8_t>{0, 255, 186}));
}

std::uint32_t crc_of(std::span<const std::uint8_t> bytes) {
    std::uint32_t crc = 0xffffffff;
    for (const auto byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? (crc >> 1) ^ 0xedb88320 : crc >> 1;
    }
    return ~crc;
}

// The PNG with that chunk in place of sRGB, which libpng writes; an empty name: without any.
std::vector<std::uint8_t> with_chunk(std::vector<std::uint8_t> png, const std::string& name,
                                     const std::vector<std::uint8_t>& data) {
    const std::string srgb = "sRGB";
    const auto at = std::search(png.begin(), png.end(), srgb.begin(), srgb.end());
    if (at == png.end()) return {};
    const auto begin = png.erase(at - 4, at + 9);
    if (name.empty()) return png;
    std::vector<std::uint8_t> chunk(name.begin(), name.end());
    chunk.insert(chunk.end(), data.begin(), data.end());
    const auto crc = crc_of(chunk);
    const auto number = [](std::uint32_t value) {
        return std::vector<std::uint8_t>{static_cast<std::uint8_t>(value >> 24), static_cast<std::uint8_t>(value >> 16),
                                         static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    };
    const auto length = number(static_cast<std::uint32_t>(data.size())), check = number(crc);
    chunk.insert(chunk.begin(), length.begin(), length.end());
    chunk.insert(chunk.end(), check.begin(), check.end());
    png.insert(begin, chunk.begin(), chunk.end());
    return png;
}

TEST(ImageFile, TheGammaOfAPngIsAppliedUnlessItIsThatOfSrgb) {
    const std::vector<std::uint8_t> pixel{128, 10, 250};
    const auto png = samples::png_of(1, 1, PNG_FORMAT_RGB, pixel.data());
    const auto of_gamma = [&](std::uint32_t gamma) {
        const auto byte = [&](int shift) { return static_cast<std::uint8_t>(gamma >> shift); };
        const auto read = read_image(with_chunk(png, "gAMA", {byte(24), byte(16), byte(8), byte(0)}));
        EXPECT_TRUE(read.has_value());
        return read ? read->rgb : std::vector<std::uint8_t>();
    };
    EXPECT_EQ(of_gamma(45455), pixel);
    EXPECT_EQ(of_gamma(100000)[0], 186) << "linear light";
    EXPECT_EQ(read_image(with_chunk(png, "", {}))->rgb, pixel) << "none is said";
}

TEST(ImageFile, PalettesBecomeTheirColours) {
    // It has two colours, which libpng writes with one bit a pixel.
    const std::vector<std::uint8_t> colours{9, 8, 7, 200, 100, 50}, indices{0, 1, 1, 0};
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = png.height = 2;
    png.format = PNG_FORMAT_RGB_COLORMAP;
    png.colormap_entries = 2;
    std::vector<std::uint8_t> bytes(4096);
    png_alloc_size_t size = bytes.size();
    ASSERT_TRUE(png_image_write_to_memory(&png, bytes.data(), &size, 0, indices.data(), 0, colours.data()));
    bytes.resize(size);
    const auto read = read_image(bytes);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->rgb, (std::vector<std::uint8_t>{9, 8, 7, 200, 100, 50, 200, 100, 50, 9, 8, 7}));
}

int worst_of(const Image& a, const Image& b) {
    if (a.rgb.size() != b.rgb.size()) return 255;
    int worst = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) worst = std::max(worst, std::abs(int{a.rgb[i]} - int{b.rgb[i]}));
    return worst;
}

TEST(ImageFile, InksOfAJpegBecomeLight) {
    // Inverted, as Adobe's programs write them: 255 is no ink.
    std::vector<std::uint8_t> pixels, bytes(tjBufSize(8, 8, TJSAMP_444));
    for (int p = 0; p < 64; ++p) pixels.insert(pixels.end(), {250, 100, 50, 204});
    auto size = static_cast<unsigned long>(bytes.size());
    unsigned char* to = bytes.data();
    void* jpeg = tjInitCompress();
    ASSERT_EQ(tjCompress2(jpeg, pixels.data(), 8, 32, 8, TJPF_CMYK, &to, &size, TJSAMP_444, 98, TJFLAG_NOREALLOC), 0);
    tjDestroy(jpeg);
    const auto read = read_image(std::span(bytes).first(size));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_LE(worst_of(*read, samples::plain(8, 8, {200, 80, 40})), 3);
}

TEST(ImageFile, SmallMistakesOfAJpegChangeNothing) {
    const auto bytes = *write_jpeg_image(noise(32, 32));
    const Image image = *read_image(bytes);
    const std::vector<std::uint8_t> scan{0xff, 0xda}, junk{1, 2, 3, 0, 0};
    const auto at = std::search(bytes.begin(), bytes.end(), scan.begin(), scan.end()) - bytes.begin();
    auto before_scan = bytes, before_end = bytes, behind = bytes, without_end = bytes, without_tables = bytes;
    before_scan.insert(before_scan.begin() + at, junk.begin(), junk.end());
    before_end.insert(before_end.end() - 2, junk.begin(), junk.end());
    behind.insert(behind.end(), 300, 0x55);
    without_end.resize(bytes.size() - 2);
    // Frames of motion JPEG leave out the tables that the standard gives.
    for (std::size_t marker = 2; without_tables[marker + 1] != 0xda;) {
        const auto length = 2 + static_cast<std::size_t>(without_tables[marker + 2] << 8 | without_tables[marker + 3]);
        const auto begin = without_tables.begin() + static_cast<std::ptrdiff_t>(marker);
        if (without_tables[marker + 1] == 0xc4)
            without_tables.erase(begin, begin + static_cast<std::ptrdiff_t>(length));
        else
            marker += length;
    }
    ASSERT_LT(without_tables.size(), bytes.size());
    for (const auto& changed : {before_scan, before_end, behind, without_end, without_tables}) {
        std::string damage;
        const auto read = read_image(changed, largest_image_side, &damage);
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_EQ(read->rgb, image.rgb);
        EXPECT_EQ(damage, "");
    }
}

TEST(ImageFile, DamageWithinAJpegIsTold) {
    auto bytes = *write_jpeg_image(noise(64, 64));
    const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * 9 / 10);
    std::fill(middle, middle + 40, std::uint8_t{0xff});
    std::string damage;
    const auto read = read_image(bytes, largest_image_side, &damage);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_NE(damage, "");
}

TEST(ImageFile, OrientationBesideTheJpegIsPassedOver) {
    auto bytes = *write_jpeg_image(gradient(16, 8));
    const std::string exif(
        "\xff\xe1\0\x22"
        "Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0",
        36);
    bytes.insert(bytes.begin() + 2, exif.begin(), exif.end());
    const auto read = read_image(bytes);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->width, 16) << "coordinates are about the pixels as they lie";
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
    const auto error_of = [](std::string_view text) {
        const auto read = read_image(samples::bytes_of(text));
        return read ? Error{} : read.error();
    };
    EXPECT_THAT(error_of("GIF89a and so on").message,
                HasSubstr("this is a GIF image, which is not read; save it as PNG"));
    EXPECT_EQ(error_of("GIF89a and so on").kind, ErrorKind::unsupported);
    EXPECT_THAT(error_of({"II*\0\x08\0", 6}).message, HasSubstr("a TIFF image"));
    EXPECT_THAT(error_of("\xabKTX 20\xbb").message, HasSubstr("a KTX image"));
    EXPECT_THAT(error_of({"\0\0\0\x1c"
                          "ftypavif",
                          12})
                    .message,
                HasSubstr("an AVIF image"));
    EXPECT_THAT(error_of({"\0\0\0\x1c"
                          "ftypheic",
                          12})
                    .message,
                HasSubstr("an HEIC image"));
    EXPECT_THAT(error_of({"\0\0\0\x0cJXL \r\n\x87\n", 12}).message, HasSubstr("a JPEG XL image"));
    EXPECT_THAT(error_of("8BPS and so on").message, HasSubstr("PSD"));
    EXPECT_THAT(error_of("\x76\x2f\x31\x01 and so on").message, HasSubstr("OpenEXR"));
    EXPECT_THAT(error_of("nothing of the kind").message,
                HasSubstr("no PNG, JPEG or WebP image; save it as one of them"));
    const auto empty = read_image({});
    ASSERT_FALSE(empty.has_value());
    EXPECT_THAT(empty.error().message, HasSubstr("empty"));
    const auto missing = read_image_file("/nowhere/tex.png");
    ASSERT_FALSE(missing.has_value());
    EXPECT_THAT(missing.error().message, HasSubstr("/nowhere/tex.png: there is no such file"));
}

}  // namespace
}  // namespace htvm
