#include "io/image_dds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "io/image_file.h"
#include "io/image_samples.h"

namespace htvm {
namespace {

using Bytes = std::vector<std::uint8_t>;
using samples::append;
using samples::error_of;
using testing::HasSubstr;

Bytes dds(std::uint32_t width, std::uint32_t height, std::uint32_t flags, const std::string& kind, std::uint32_t bits,
          std::initializer_list<std::uint32_t> masks, const Bytes& behind) {
    Bytes out{'D', 'D', 'S', ' '};
    append(out, 124, 4);
    append(out, 0x1007, 4);
    append(out, height, 4);
    append(out, width, 4);
    out.resize(76);
    append(out, 32, 4);
    append(out, flags, 4);
    out.insert(out.end(), kind.begin(), kind.end());
    out.resize(88);
    append(out, bits, 4);
    for (const auto mask : masks) append(out, mask, 4);
    out.resize(128);
    out.insert(out.end(), behind.begin(), behind.end());
    return out;
}

// Two colours of five, six and five bits, and two bits for each of 16 pixels.
Bytes block(std::uint32_t first, std::uint32_t second, std::uint32_t choices) {
    Bytes out;
    append(out, first, 2);
    append(out, second, 2);
    append(out, choices, 4);
    return out;
}

Bytes first_pixels(const Bytes& bytes, std::size_t count) {
    const auto image = read_image(bytes);
    EXPECT_TRUE(image.has_value()) << (image ? "" : image.error().message);
    if (!image) return {};
    return {image->rgb.begin(), image->rgb.begin() + static_cast<std::ptrdiff_t>(3 * count)};
}

constexpr std::uint32_t red = 0xf800, blue = 0x001f, compressed = 4, coloured = 0x40, grey = 0x20000;
constexpr std::uint32_t all_in_turn = 0xe4;  // 0, 1, 2, 3

TEST(Dds, BlocksOfFourColours) {
    const Bytes expected{255, 0, 0, 0, 0, 255, 170, 0, 85, 85, 0, 170};
    EXPECT_EQ(first_pixels(dds(4, 4, compressed, "DXT1", 0, {}, block(red, blue, all_in_turn)), 4), expected);
    Bytes with_alpha(8, 0x77);
    const auto colours = block(red, blue, all_in_turn);
    with_alpha.insert(with_alpha.end(), colours.begin(), colours.end());
    for (const char* kind : {"DXT3", "DXT5"})
        EXPECT_EQ(first_pixels(dds(4, 4, compressed, kind, 0, {}, with_alpha), 4), expected) << kind;
    Bytes of_10;
    for (const std::uint32_t value : {71u, 3u, 0u, 1u, 0u}) append(of_10, value, 4);
    of_10.insert(of_10.end(), colours.begin(), colours.end());
    EXPECT_EQ(first_pixels(dds(4, 4, compressed, "DX10", 0, {}, of_10), 4), expected);
}

TEST(Dds, BlocksOfThreeColoursAndBlack) {
    EXPECT_EQ(first_pixels(dds(4, 4, compressed, "DXT1", 0, {}, block(blue, red, all_in_turn)), 4),
              (Bytes{0, 0, 255, 255, 0, 0, 127, 0, 127, 0, 0, 0}));
    Bytes with_alpha(8);
    const auto colours = block(blue, red, all_in_turn);
    with_alpha.insert(with_alpha.end(), colours.begin(), colours.end());
    EXPECT_EQ(first_pixels(dds(4, 4, compressed, "DXT5", 0, {}, with_alpha), 4),
              (Bytes{0, 0, 255, 255, 0, 0, 85, 0, 170, 170, 0, 85}))
        << "of these, four always";
}

TEST(Dds, SizesThatBlocksDoNotDivide) {
    Bytes blocks;
    for (const auto colour : {red, blue}) {
        const auto one = block(colour, colour, 0);
        blocks.insert(blocks.end(), one.begin(), one.end());
    }
    const auto image = read_image(dds(5, 3, compressed, "DXT1", 0, {}, blocks));
    ASSERT_TRUE(image.has_value());
    EXPECT_EQ(image->width, 5);
    EXPECT_EQ(image->height, 3);
    EXPECT_EQ(Bytes(image->rgb.end() - 6, image->rgb.end()), (Bytes{255, 0, 0, 0, 0, 255}));
}

TEST(Dds, UncompressedByTheirMasks) {
    EXPECT_EQ(first_pixels(dds(1, 1, coloured, "", 32, {0xff0000, 0xff00, 0xff, 0xff000000}, {3, 2, 1, 0}), 1),
              (Bytes{1, 2, 3}));
    EXPECT_EQ(first_pixels(dds(1, 1, coloured, "", 24, {0xff, 0xff00, 0xff0000}, {1, 2, 3}), 1), (Bytes{1, 2, 3}));
    EXPECT_EQ(first_pixels(dds(1, 1, coloured, "", 16, {0xf800, 0x7e0, 0x1f}, {0x00, 0xf8}), 1), (Bytes{255, 0, 0}));
    EXPECT_EQ(first_pixels(dds(1, 1, grey, "", 8, {0xff}, {77}), 1), (Bytes{77, 77, 77}));
}

TEST(Dds, OthersAreRefused) {
    Bytes of_10;
    for (const std::uint32_t value : {98u, 3u, 0u, 1u, 0u}) append(of_10, value, 4);
    of_10.resize(of_10.size() + 16);
    const auto error = error_of(dds(4, 4, compressed, "DX10", 0, {}, of_10));
    EXPECT_EQ(error.kind, ErrorKind::unsupported);
    EXPECT_THAT(error.message, HasSubstr("the DXGI format 98, such as BC7, which is not read"));
    EXPECT_THAT(error_of(dds(4, 4, compressed, "ATI2", 0, {}, Bytes(16))).message, HasSubstr("kind ATI2"));
    const auto whole = dds(8, 8, compressed, "DXT1", 0, {}, Bytes(32));
    for (std::size_t size = 4; size < whole.size(); ++size)
        EXPECT_FALSE(read_image(std::span(whole).first(size)).has_value()) << size;
    EXPECT_EQ(error_of(dds(1u << 31, 1, compressed, "DXT1", 0, {}, {})).kind, ErrorKind::limit);
}

}  // namespace
}  // namespace htvm
