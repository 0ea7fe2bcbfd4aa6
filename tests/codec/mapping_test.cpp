#include "codec/mapping.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"

namespace htvm {
namespace {

using test::below;

std::size_t sum(const std::vector<std::uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

void expect_comes_back(const std::vector<std::uint32_t>& counts) {
    const auto decoded = decode_mapping(encode_mapping(counts), counts.size(), sum(counts));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    EXPECT_EQ(*decoded, counts);
}

std::vector<std::uint32_t> random_counts(std::mt19937& random) {
    std::vector<std::uint32_t> counts(random() % 200);
    const std::uint32_t most = 1 + below(random, 5), some = 1 + below(random, 4);
    for (auto& n : counts) n = below(random, some) == 0 ? below(random, most + 1) : 1;
    return counts;
}

TEST(Mapping, NothingTakesNoBytes) {
    EXPECT_TRUE(encode_mapping({}).empty());
    EXPECT_TRUE(encode_mapping(std::vector<std::uint32_t>(50, 0)).empty());
    EXPECT_TRUE(encode_mapping(std::vector<std::uint32_t>{1234}).empty()) << "all belong to the only reference vertex";
    EXPECT_EQ(*decode_mapping({}, 0, 0), std::vector<std::uint32_t>{});
    EXPECT_EQ(*decode_mapping({}, 3, 0), (std::vector<std::uint32_t>{0, 0, 0}));
    EXPECT_EQ(*decode_mapping({}, 1, 1234), std::vector<std::uint32_t>{1234});
}

TEST(Mapping, ComesBack) {
    for (const auto& counts : std::vector<std::vector<std::uint32_t>>{
             {1}, {0, 1}, {1, 0}, {0, 0, 7}, {7, 0, 0}, {1, 1, 1, 1}, {0, 5, 0, 5}, {100000, 0, 3}, {0, 100000}})
        expect_comes_back(counts);
    std::mt19937 random(1);
    for (int i = 0; i < 300; ++i) expect_comes_back(random_counts(random));
}

TEST(Mapping, OneResidualEachCostsNextToNothing) {
    EXPECT_LT(encode_mapping(std::vector<std::uint32_t>(10000, 1)).size(), 100u);
}

TEST(Mapping, StaysBelowTheBoundOfThePaper) {
    // Section IV-C3: a bit a node, N_I + N_t nodes; adaptive coding may add a little.
    std::mt19937 random(2);
    std::vector<std::uint32_t> counts(10000);
    for (auto& n : counts) n = below(random, 2) + below(random, 2);
    EXPECT_LT(8 * encode_mapping(counts).size(), (counts.size() + sum(counts)) * 102 / 100);
}

TEST(Mapping, DamageGivesAnErrorOrAsManyResidualsAsAsked) {
    std::mt19937 random(3);
    for (int i = 0; i < 10; ++i) {
        const auto counts = random_counts(random);
        const std::size_t references = counts.size(), residuals = sum(counts);
        hostile::try_everything(
            encode_mapping(counts),
            [&](const std::vector<std::uint8_t>& bytes) {
                const auto decoded = decode_mapping(bytes, references, residuals);
                if (!decoded) {
                    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
                    return;
                }
                EXPECT_EQ(decoded->size(), references);
                EXPECT_EQ(sum(*decoded), references > 0 ? residuals : 0);
            },
            100);
    }
}

}  // namespace
}  // namespace htvm
