#include "codec/bones/codebook.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"
#include "core/lattice.h"
#include "entropy/cost.h"

namespace htvm::internal {
namespace {

Codebook random_codebook(std::size_t size, std::int32_t reach, std::int32_t scale, std::mt19937& random) {
    Codebook out;
    out.escape_step = test::between(random, 1, 1000);
    std::uint32_t length = 0;
    for (std::size_t i = 0; i < size; ++i) {
        ResidualVector codeword{};
        for (auto& c : codeword) c = test::between(random, -reach, reach) * scale;
        out.codewords.push_back(codeword);
        if (random() % 8 == 0) length = std::min<std::uint32_t>(length + test::below(random, 9), max_length);
        out.lengths.push_back(static_cast<std::uint16_t>(length));
    }
    out.lengths.push_back(static_cast<std::uint16_t>(test::below(random, max_length + 1)));
    return out;
}

void expect_comes_back(const Codebook& codebook) {
    const auto decoded = decode_codebook(encode_codebook(codebook));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    EXPECT_EQ(*decoded, codebook);
}

TEST(Codebook, OfNoCodewordsHasOnlyTheEscape) {
    Codebook codebook;
    codebook.lengths = {0};
    expect_comes_back(codebook);
    EXPECT_EQ(index_model(codebook).bits(), 0);
}

TEST(Codebook, ComesBack) {
    std::mt19937 random(1);
    for (const std::size_t size : {1u, 2u, 3u, 100u, 4095u})
        for (const std::int32_t scale : {1, 7, 4096}) expect_comes_back(random_codebook(size, 1000, scale, random));
}

TEST(Codebook, OfZeroCodewordsComesBack) {
    Codebook codebook;
    codebook.codewords.assign(3, {0, 0, 0});
    codebook.lengths = {4, 4, 8, 160};
    expect_comes_back(codebook);
}

TEST(Codebook, TheLargestResidualsComeBack) {
    // A vertex at one end of the range of captures, predicted at the other end of the lattice, and beyond.
    for (const std::int32_t extreme : {(1 << 24) + (1 << 23), 1 << 25, 1 << 26}) {
        Codebook codebook;
        codebook.codewords = {{extreme, 0, 0}, {0, -extreme, extreme}};
        codebook.lengths = {0, max_length, max_length};
        codebook.escape_step = 1 << 24;
        expect_comes_back(codebook);
    }
}

TEST(Codebook, ACommonFactorOfTheCodewordsIsNotPaidFor) {
    std::mt19937 random(2);
    auto codebook = random_codebook(500, 20, 1, random);
    const auto fine = encode_codebook(codebook).size();
    for (auto& codeword : codebook.codewords)
        for (auto& c : codeword) c *= 64;
    EXPECT_LT(encode_codebook(codebook).size(), fine + 8);
}

TEST(Codebook, DamageGivesAnErrorOrACodebookInRange) {
    std::mt19937 random(3);
    for (const std::size_t size : {0u, 1u, 50u, 300u})
        hostile::try_everything(encode_codebook(random_codebook(size, 100, 8, random)),
                                [](const std::vector<std::uint8_t>& bytes) {
                                    const auto decoded = decode_codebook(bytes);
                                    if (!decoded) {
                                        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
                                        return;
                                    }
                                    ASSERT_LE(decoded->codewords.size(), max_codewords);
                                    ASSERT_EQ(decoded->lengths.size(), decoded->codewords.size() + 1);
                                    EXPECT_GE(decoded->escape_step, 1);
                                    for (const auto length : decoded->lengths) EXPECT_LE(length, max_length);
                                    for (const auto& codeword : decoded->codewords)
                                        for (const auto c : codeword) EXPECT_LE(std::abs(c), 1 << 26);
                                    auto model = index_model(*decoded);
                                    EXPECT_GE(1u << model.bits(), decoded->lengths.size());
                                });
}

TEST(IndexModel, StartsWithTheCodeLengths) {
    Codebook codebook;
    codebook.codewords.assign(4, {0, 0, 0});
    codebook.lengths = {8, 16, 24, 32, 32};  // 1, 2, 3, 4, 4 bits: a complete code
    for (std::uint32_t i = 0; i < codebook.lengths.size(); ++i) {
        auto model = index_model(codebook);
        CostCounter cost;
        encode_symbol(cost, model, i);
        EXPECT_NEAR(cost.bits(), codebook.lengths[i] / 8.0, 0.01);
    }
}

TEST(IndexModel, IsSoundForTheLongestLengthsEverywhere) {
    Codebook codebook;
    codebook.codewords.assign(max_codewords, {0, 0, 0});
    codebook.lengths.assign(max_codewords + 1, max_length);
    auto model = index_model(codebook);
    CostCounter cost;
    encode_symbol(cost, model, max_codewords);
    EXPECT_NEAR(cost.bits(), 12, 0.1);
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

Codebook codebook_of(std::size_t size) {
    Codebook out;
    out.escape_step = 10;
    for (std::size_t i = 0; i < size; ++i) {
        const auto c = static_cast<std::int32_t>(i);
        out.codewords.push_back({c, -c, 3 * c});
        out.lengths.push_back(static_cast<std::uint16_t>(std::min<std::size_t>(i, max_length)));
    }
    out.lengths.push_back(40);
    return out;
}

QuantisedResiduals random_residuals(const Codebook& codebook, std::size_t count, std::int32_t reach,
                                    std::mt19937& random) {
    QuantisedResiduals out;
    for (std::size_t k = 0; k < count; ++k) {
        const auto index = static_cast<std::uint16_t>(random() % (codebook.codewords.size() + 1));
        ResidualVector value{};
        if (index < codebook.codewords.size()) {
            value = codebook.codewords[index];
        } else {
            for (auto& c : value) c = test::between(random, -reach, reach) * 10;
        }
        out.indices.push_back(index);
        out.values.push_back(value);
    }
    return out;
}

TEST(ResidualLayer, NothingTakesNoBytes) {
    const auto codebook = codebook_of(3);
    EXPECT_TRUE(encode_residuals({}, codebook).empty());
    EXPECT_TRUE(decode_residuals({}, 0, codebook)->empty());
}

TEST(ResidualLayer, ComesBackEscapesIncluded) {
    std::mt19937 random(1);
    for (const std::size_t size : {0u, 1u, 2u, 3u, 200u, 4095u})
        for (const std::size_t count : {1u, 2u, 1000u})
            for (const std::int32_t reach : {0, 5, 100000, 6710886}) {
                const auto codebook = codebook_of(size);
                const auto residuals = random_residuals(codebook, count, reach, random);
                const auto decoded = decode_residuals(encode_residuals(residuals, codebook), count, codebook);
                ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
                EXPECT_EQ(*decoded, residuals.values);
            }
}

TEST(ResidualLayer, ASingleCodewordCostsNoBits) {
    auto codebook = codebook_of(1);
    codebook.lengths = {0, max_length};
    QuantisedResiduals residuals;
    residuals.indices.assign(10000, 0);
    residuals.values.assign(10000, codebook.codewords[0]);
    EXPECT_LT(encode_residuals(residuals, codebook).size(), 20u);
}

TEST(ResidualLayer, DamageGivesAnErrorOrResidualsInRange) {
    std::mt19937 random(2);
    for (const std::size_t size : {0u, 1u, 100u}) {
        const auto codebook = codebook_of(size);
        const auto residuals = random_residuals(codebook, 300, 50, random);
        hostile::try_everything(encode_residuals(residuals, codebook), [&](const std::vector<std::uint8_t>& bytes) {
            const auto decoded = decode_residuals(bytes, 300, codebook);
            if (!decoded) {
                EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
                return;
            }
            EXPECT_EQ(decoded->size(), 300u);
            for (const auto& value : *decoded)
                for (const auto c : value) EXPECT_LE(std::abs(c), 4 * lattice_limit);
        });
    }
}

TEST(ResidualLayer, AHugeCountWithFewBytesEndsSoon) {
    const auto codebook = codebook_of(100);
    const auto decoded = decode_residuals(std::vector<std::uint8_t>(20, 0x55), std::size_t{1} << 40, codebook);
    ASSERT_FALSE(decoded.has_value());
    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
}

}  // namespace
}  // namespace htvm::internal
