#include "codec/paper/residual_layer.h"

#include <gtest/gtest.h>

#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"
#include "core/lattice.h"

namespace htvm::internal {
namespace {

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
