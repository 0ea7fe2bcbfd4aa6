#include "io/image_bitmap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
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

// A header of 40 bytes, what stands behind it (masks or a palette), and the pixels.
Bytes bmp(int width, int height, std::uint32_t bits, std::uint32_t coding, const Bytes& tables, const Bytes& pixels) {
    Bytes out{'B', 'M'};
    append(out, 0, 8);
    append(out, 54 + static_cast<std::uint32_t>(tables.size()), 4);
    append(out, 40, 4);
    append(out, static_cast<std::uint32_t>(width), 4);
    append(out, static_cast<std::uint32_t>(height), 4);
    append(out, 1, 2);
    append(out, bits, 2);
    append(out, coding, 4);
    append(out, 0, 20);
    out.insert(out.end(), tables.begin(), tables.end());
    out.insert(out.end(), pixels.begin(), pixels.end());
    return out;
}

Bytes read(const Bytes& bytes) {
    const auto image = read_image(bytes);
    EXPECT_TRUE(image.has_value()) << (image ? "" : image.error().message);
    return image ? image->rgb : Bytes();
}

TEST(Bmp, RowsComeFromTheBottomOrTheTop) {
    const Bytes pixels{3, 2, 1, 6, 5, 4, 0, 0, 9, 8, 7, 12, 11, 10, 0, 0};  // blue first, rows of whole fours
    EXPECT_EQ(read(bmp(2, 2, 24, 0, {}, pixels)), (Bytes{7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(read(bmp(2, -2, 24, 0, {}, pixels)), (Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
}

TEST(Bmp, PalettesOfOneFourAndEightBits) {
    Bytes palette(4 * 2), longer(4 * 16), longest(4 * 256);
    for (auto* colours : {&palette, &longer, &longest})
        std::copy_n(std::initializer_list<std::uint8_t>{30, 20, 10, 0, 60, 50, 40, 0}.begin(), 8, colours->begin());
    const Bytes expected{40, 50, 60, 10, 20, 30, 40, 50, 60};
    EXPECT_EQ(read(bmp(3, 1, 1, 0, palette, {0xa0, 0, 0, 0})), expected);
    EXPECT_EQ(read(bmp(3, 1, 4, 0, longer, {0x10, 0x10, 0, 0})), expected);
    EXPECT_EQ(read(bmp(3, 1, 8, 0, longest, {1, 0, 1, 0})), expected);
}

TEST(Bmp, MasksAndThirtyTwoBits) {
    EXPECT_EQ(read(bmp(2, 1, 32, 0, {}, {3, 2, 1, 0, 6, 5, 4, 255})), (Bytes{1, 2, 3, 4, 5, 6}));
    Bytes masks;
    for (const std::uint32_t mask : {0xf800u, 0x07e0u, 0x001fu}) append(masks, mask, 4);
    EXPECT_EQ(read(bmp(2, 1, 16, 3, masks, {0x00, 0xf8, 0xff, 0xff})), (Bytes{255, 0, 0, 255, 255, 255}));
    EXPECT_EQ(read(bmp(2, 1, 16, 0, {}, {0x00, 0x7c, 0x1f, 0x00})), (Bytes{255, 0, 0, 0, 0, 255})) << "five bits each";
}

TEST(Bmp, RunsOfFourAndEightBits) {
    Bytes longer(4 * 16), longest(4 * 256);
    for (auto* colours : {&longer, &longest}) (*colours)[4] = 9;  // the blue of the second colour
    // Three of 1; then 0 1 0 as they stand, with a byte to fill; the end.
    const Bytes runs{3, 1, 0, 0, 0, 3, 0, 1, 0, 0, 0, 1};
    const Bytes expected{0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 9, 0, 0, 9, 0, 0, 9};
    EXPECT_EQ(read(bmp(3, 2, 8, 1, longest, runs)), expected);
    EXPECT_EQ(read(bmp(3, 2, 4, 2, longer, {3, 0x11, 0, 0, 0, 3, 0x01, 0x00, 0, 1})), expected);
}

TEST(Bmp, OnesCutOffOrUnknownAreErrors) {
    const auto whole = bmp(4, 4, 24, 0, {}, Bytes(48));
    for (std::size_t size = 20; size < whole.size(); ++size)
        EXPECT_FALSE(read_image(std::span(whole).first(size)).has_value()) << size;
    EXPECT_THAT(error_of(bmp(1, 1, 24, 4, {}, Bytes(4))).message, HasSubstr("of coding 4, which is not read"));
    EXPECT_EQ(error_of(bmp(100000, 1, 24, 0, {}, Bytes(4))).kind, ErrorKind::limit);
}

Bytes tga(std::uint8_t kind, int width, int height, std::uint8_t bits, std::uint8_t descriptor, const Bytes& palette,
          const Bytes& pixels, bool is_marked = true) {
    Bytes out{2, static_cast<std::uint8_t>(palette.empty() ? 0 : 1), kind};
    append(out, 0, 2);
    append(out, static_cast<std::uint32_t>(palette.size() / 3), 2);
    out.push_back(palette.empty() ? 0 : 24);
    append(out, 0, 4);
    append(out, static_cast<std::uint32_t>(width), 2);
    append(out, static_cast<std::uint32_t>(height), 2);
    out.insert(out.end(), {bits, descriptor, 'i', 'd'});
    out.insert(out.end(), palette.begin(), palette.end());
    out.insert(out.end(), pixels.begin(), pixels.end());
    if (!is_marked) return out;
    append(out, 0, 4);
    append(out, 0, 4);
    const std::string mark("TRUEVISION-XFILE.\0", 18);
    out.insert(out.end(), mark.begin(), mark.end());
    return out;
}

TEST(Tga, RowsAndColumnsComeFromAnyCorner) {
    const Bytes pixels{3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10};
    EXPECT_EQ(read(tga(2, 2, 2, 24, 0x20, {}, pixels)), (Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
    EXPECT_EQ(read(tga(2, 2, 2, 24, 0x20, {}, pixels, false)), (Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
    EXPECT_EQ(read(tga(2, 2, 2, 24, 0x00, {}, pixels)), (Bytes{7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(read(tga(2, 2, 2, 24, 0x30, {}, pixels)), (Bytes{4, 5, 6, 1, 2, 3, 10, 11, 12, 7, 8, 9}));
    EXPECT_THAT(error_of(tga(2, 2, 2, 24, 0x00, {}, pixels, false)).message, HasSubstr("could be upside down"));
}

TEST(Tga, GreysPalettesAndSixteenBits) {
    EXPECT_EQ(read(tga(3, 2, 1, 8, 0x20, {}, {7, 200})), (Bytes{7, 7, 7, 200, 200, 200}));
    EXPECT_EQ(read(tga(1, 2, 1, 8, 0x20, {3, 2, 1, 6, 5, 4}, {1, 0})), (Bytes{4, 5, 6, 1, 2, 3}));
    EXPECT_EQ(read(tga(2, 2, 1, 16, 0x20, {}, {0x00, 0x7c, 0x1f, 0x80})), (Bytes{255, 0, 0, 0, 0, 255}));
    EXPECT_EQ(read(tga(2, 1, 1, 32, 0x28, {}, {3, 2, 1, 0})), (Bytes{1, 2, 3})) << "whatever its alpha";
}

TEST(Tga, Runs) {
    // Two of one, then three as they stand, over the end of a row.
    EXPECT_EQ(read(tga(11, 5, 1, 8, 0x20, {}, {0x81, 9, 0x02, 1, 2, 3})),
              (Bytes{9, 9, 9, 9, 9, 9, 1, 1, 1, 2, 2, 2, 3, 3, 3}));
    EXPECT_EQ(read(tga(10, 2, 2, 24, 0x20, {}, {0x83, 3, 2, 1})), (Bytes{1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3}));
    EXPECT_FALSE(read_image(tga(10, 2, 2, 24, 0x20, {}, {0x81, 3, 2, 1}, false)).has_value());
}

TEST(Tga, OnesCutOffAreErrors) {
    const auto whole = tga(2, 4, 4, 24, 0x20, {}, Bytes(48), false);
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(read_image(std::span(whole).first(size)).has_value()) << size;
}

}  // namespace
}  // namespace htvm
