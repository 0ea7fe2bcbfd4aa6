// Sizes in the headers of VP9 frames, told without decoding them.
#include "texture/vp9_frame_size.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace htvm::internal {
namespace {

using Bytes = std::vector<std::uint8_t>;

// "10 00 ..." as bytes, filled up with zeros.
Bytes bits(const std::string& text) {
    std::string digits;
    for (const char c : text)
        if (c != ' ') digits += c;
    while (digits.size() % 8 != 0) digits += '0';
    Bytes out;
    for (std::size_t i = 0; i < digits.size(); i += 8)
        out.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 8), nullptr, 2)));
    return out;
}

const std::string sync_code = "01001001 10000011 01000010";
// Marker, profile 0, shown, sync code, colour space, range, 1024 x 512.
const std::string key = "10 00 0 0 1 0 " + sync_code + " 010 0 0000001111111111 0000000111111111";

TEST(LongestVp9Side, IsThatOfAKeyFrame) { EXPECT_EQ(longest_vp9_side(bits(key)), 1024u); }

TEST(LongestVp9Side, IsZeroWhereAReferenceHasIt) {
    EXPECT_EQ(longest_vp9_side(bits("10 00 0 1 1 0 00 00000001 0010 0100 0110 0 1")), 0u);
    EXPECT_EQ(longest_vp9_side(bits("10 00 1 000")), 0u);  // shown again
}

TEST(LongestVp9Side, OfAFrameBetweenThatNamesIts) {
    EXPECT_EQ(
        longest_vp9_side(bits("10 00 0 1 1 0 00 00000001 0010 0100 0110 0 0 0 1111111111111111 0000000000000111")),
        65536u);
}

TEST(LongestVp9Side, OfASuperframeIsThatOfItsLargestFrame) {
    auto packet = bits("10 00 1 000");
    const auto frame = bits(key);
    packet.insert(packet.end(), frame.begin(), frame.end());
    // Two frames, their sizes in one byte each.
    for (const std::size_t byte : {std::size_t{0xc1}, std::size_t{1}, frame.size(), std::size_t{0xc1}})
        packet.push_back(static_cast<std::uint8_t>(byte));
    EXPECT_EQ(longest_vp9_side(packet), 1024u);
    packet[packet.size() - 2] = 200;  // longer than there is
    EXPECT_EQ(longest_vp9_side(packet), std::nullopt);
}

TEST(LongestVp9Side, OfWhatIsNoVp9IsUnknown) {
    EXPECT_EQ(longest_vp9_side({}), std::nullopt);
    EXPECT_EQ(longest_vp9_side(bits("01 00 0 0 1 0")), std::nullopt);
    EXPECT_EQ(longest_vp9_side(bits("10 10 0 0 1 0 " + sync_code)), std::nullopt);  // another profile
    auto cut_short = bits(key);
    cut_short.resize(6);
    EXPECT_EQ(longest_vp9_side(cut_short), std::nullopt);
}

}  // namespace
}  // namespace htvm::internal
