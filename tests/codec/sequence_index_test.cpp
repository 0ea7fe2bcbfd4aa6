#include "codec/stream/sequence_index.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "codec/hostile_bytes.h"
#include "core/bytes.h"

namespace htvm::internal {
namespace {

void expect_comes_back(const std::vector<IndexEntry>& entries) {
    const auto read = read_sequence_index(write_sequence_index(entries));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(*read, entries);
}

std::vector<IndexEntry> thousand() {
    std::vector<IndexEntry> entries;
    for (std::uint32_t i = 0; i < 1000; ++i)
        entries.push_back({30 * i, -5 + 1000000 * std::int64_t{i}, 90 + 123456 * i});
    return entries;
}

TEST(SequenceIndex, ComesBack) {
    expect_comes_back({});
    expect_comes_back({{0, 0, 0}});
    expect_comes_back(thousand());
}

TEST(SequenceIndex, ExtremesComeBack) {
    constexpr auto low = std::numeric_limits<std::int64_t>::min(), high = std::numeric_limits<std::int64_t>::max();
    expect_comes_back({{0, low, 0}, {1, high, 1}, {~0u, high, ~0ull}});
    expect_comes_back({{5, high, 7}, {6, low, 8}, {7, -1, 9}});
}

TEST(SequenceIndex, ACountThatTheBytesCannotHoldIsAnError) {
    ByteWriter out;
    out.varint(~0ull);
    out.varint(1);
    const auto read = read_sequence_index(out.data());
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream);
}

TEST(SequenceIndex, DamageIsSurvived) {
    hostile::try_everything(write_sequence_index(thousand()), [](const std::vector<std::uint8_t>& bytes) {
        const auto read = read_sequence_index(bytes);
        EXPECT_TRUE(!read || read->size() <= bytes.size());
    });
}

Codebook small_codebook() {
    Codebook codebook;
    codebook.codewords = {{0, 0, 0}, {5, -5, 10}};
    codebook.lengths = {4, 9, 20};
    codebook.escape_step = 40;
    return codebook;
}

TEST(CodebookPayload, ComesBack) {
    for (const auto purpose : {codebook_for_geometry, codebook_for_colour})
        for (const std::uint32_t number : {0u, 1u, 300u, 0x7FFFFFFFu}) {
            const auto read = read_codebook_payload(write_codebook_payload(purpose, number, small_codebook()));
            ASSERT_TRUE(read.has_value()) << read.error().message;
            EXPECT_EQ(read->purpose, purpose);
            EXPECT_EQ(read->number, number);
            EXPECT_EQ(read->codebook, small_codebook());
        }
}

TEST(CodebookPayload, OfAnUnknownPurposeIsAnError) {
    const auto read = read_codebook_payload(write_codebook_payload(2, 1, small_codebook()));
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream);
}

TEST(CodebookPayload, DamageIsSurvived) {
    hostile::try_everything(write_codebook_payload(0, 7, small_codebook()), [](const std::vector<std::uint8_t>& bytes) {
        const auto read = read_codebook_payload(bytes);
        EXPECT_TRUE(read || read.error().kind == ErrorKind::corrupt_stream);
    });
}

}  // namespace
}  // namespace htvm::internal
