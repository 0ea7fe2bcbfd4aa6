#include "core/bytes.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace htvm::internal {
namespace {

const std::vector<std::uint64_t> edges = {0,          1,           0x7f,       0x80,       0x3fff,    0x4000,
                                          0xffffffff, 0x100000000, 1ull << 62, 1ull << 63, ~0ull - 1, ~0ull};

TEST(Bytes, NumbersAreLittleEndian) {
    ByteWriter out;
    out.u8(0x01);
    out.u16(0x0302);
    out.u32(0x07060504);
    out.u64(0x0F0E0D0C0B0A0908);
    std::vector<std::uint8_t> expected(15);
    for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = static_cast<std::uint8_t>(i + 1);
    EXPECT_EQ(out.data(), expected);
}

TEST(Bytes, NumbersComeBack) {
    ByteWriter out;
    for (const auto v : edges) {
        out.u8(static_cast<std::uint8_t>(v));
        out.u16(static_cast<std::uint16_t>(v));
        out.u32(static_cast<std::uint32_t>(v));
        out.u64(v);
    }
    ByteReader in(out.data());
    for (const auto v : edges) {
        EXPECT_EQ(in.u8(), static_cast<std::uint8_t>(v));
        EXPECT_EQ(in.u16(), static_cast<std::uint16_t>(v));
        EXPECT_EQ(in.u32(), static_cast<std::uint32_t>(v));
        EXPECT_EQ(in.u64(), v);
    }
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0u);
}

TEST(Bytes, VarintsTakeSevenBitsAByte) {
    const auto size = [](std::uint64_t v) {
        ByteWriter out;
        out.varint(v);
        return out.size();
    };
    EXPECT_EQ(size(0), 1u);
    EXPECT_EQ(size(0x7f), 1u);
    EXPECT_EQ(size(0x80), 2u);
    EXPECT_EQ(size(0x3fff), 2u);
    EXPECT_EQ(size(0x4000), 3u);
    EXPECT_EQ(size(~0ull), 10u);
}

TEST(Bytes, SignedVarintsZigZag) {
    ByteWriter out;
    for (const std::int64_t v : {0, -1, 1, -2, 2, -64, 63}) out.signed_varint(v);
    EXPECT_EQ(out.data(), (std::vector<std::uint8_t>{0, 1, 2, 3, 4, 127, 126}));
}

TEST(Bytes, VarintsComeBack) {
    std::vector<std::uint64_t> values = edges;
    std::mt19937_64 random(1);
    for (int i = 0; i < 1000; ++i) values.push_back(random() >> (random() % 64));
    ByteWriter out;
    for (const auto v : values) {
        out.varint(v);
        out.signed_varint(static_cast<std::int64_t>(v));
    }
    ByteReader in(out.data());
    for (const auto v : values) {
        EXPECT_EQ(in.varint(), v);
        EXPECT_EQ(in.signed_varint(), static_cast<std::int64_t>(v));
    }
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0u);
}

TEST(Bytes, VarintsOfMoreThan64BitsAreRefused) {
    for (const int last : {0x01, 0x02, 0x7f, 0x80, 0xff}) {
        std::vector<std::uint8_t> bytes(9, 0xff);
        bytes.push_back(static_cast<std::uint8_t>(last));
        bytes.push_back(0);
        ByteReader in(bytes);
        const auto v = in.varint();
        EXPECT_EQ(in.ok(), last == 1) << last;
        EXPECT_EQ(v, last == 1 ? ~0ull : 0ull);
    }
}

TEST(Bytes, ReadingPastTheEndGivesZeroAndStaysWrong) {
    const std::vector<std::uint8_t> bytes = {1, 2, 3};
    ByteReader in(bytes);
    EXPECT_EQ(in.u16(), 0x0201);
    EXPECT_EQ(in.u32(), 0u);
    EXPECT_FALSE(in.ok());
    EXPECT_EQ(in.u8(), 0);
    EXPECT_EQ(in.varint(), 0u);
    EXPECT_FALSE(in.ok());
    EXPECT_EQ(in.remaining(), 0u);
}

TEST(Bytes, AVarintCutShortIsWrong) {
    const std::vector<std::uint8_t> bytes = {0x80, 0x80};
    ByteReader in(bytes);
    EXPECT_EQ(in.varint(), 0u);
    EXPECT_FALSE(in.ok());
}

TEST(Bytes, ASpanLongerThanWhatIsLeftIsEmptyAndWrong) {
    const std::vector<std::uint8_t> bytes = {1, 2, 3, 4};
    ByteReader in(bytes);
    EXPECT_EQ(in.bytes(0).size(), 0u);
    EXPECT_EQ(in.bytes(3).size(), 3u);
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.position(), 3u);
    EXPECT_TRUE(in.bytes(std::numeric_limits<std::uint64_t>::max()).empty());
    EXPECT_FALSE(in.ok());
}

}  // namespace
}  // namespace htvm::internal
