#include "core/crc32.h"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

namespace htvm::internal {
namespace {

std::uint32_t of_text(std::string_view text) {
    return crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// The definition, bit by bit.
std::uint32_t bit_by_bit(std::span<const std::uint8_t> data) {
    std::uint32_t c = ~0u;
    for (const auto byte : data) {
        c ^= byte;
        for (int i = 0; i < 8; ++i) c = (c & 1) ? (c >> 1) ^ 0xEDB88320u : c >> 1;
    }
    return ~c;
}

TEST(Crc32, IsThatOfZlib) {
    EXPECT_EQ(of_text(""), 0u);
    EXPECT_EQ(of_text("a"), 0xE8B7BE43u);
    EXPECT_EQ(of_text("123456789"), 0xCBF43926u);
    EXPECT_EQ(of_text("The quick brown fox jumps over the lazy dog"), 0x414FA339u);
}

TEST(Crc32, OfAnyLengthAndAlignmentIsItsDefinition) {
    std::mt19937 random(1);
    std::vector<std::uint8_t> data(100);
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
    for (std::size_t begin = 0; begin < 9; ++begin)
        for (std::size_t size = 0; begin + size <= data.size(); ++size) {
            const auto part = std::span<const std::uint8_t>(data).subspan(begin, size);
            ASSERT_EQ(crc32(part), bit_by_bit(part)) << begin << " " << size;
        }
}

TEST(Crc32, EveryFlippedBitShows) {
    std::vector<std::uint8_t> data(40, 0);
    const auto whole = crc32(data);
    for (std::size_t bit = 0; bit < data.size() * 8; ++bit) {
        data[bit / 8] = static_cast<std::uint8_t>(data[bit / 8] ^ (1u << bit % 8));
        EXPECT_NE(crc32(data), whole);
        data[bit / 8] = static_cast<std::uint8_t>(data[bit / 8] ^ (1u << bit % 8));
    }
}

}  // namespace
}  // namespace htvm::internal
