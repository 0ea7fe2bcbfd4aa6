#include "codec/encoder/bones/vector_quantiser.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <string>

#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

using Residuals = std::vector<ResidualVector>;

Residuals gaussian(std::size_t count, double deviation, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, deviation);
    Residuals out(count);
    for (auto& e : out)
        for (auto& c : e) c = static_cast<std::int32_t>(std::lround(normal(random)));
    return out;
}

struct Source {
    std::string name;
    Residuals residuals;
};

std::vector<Source> sources() {
    std::vector<Source> out = {{"nothing", {}},
                               {"one", {{5, -900, 3}}},
                               {"two far apart", {{-30000000, 1, 2}, {20000000, 20000000, -1}}},
                               {"all the same", Residuals(500, {7, 7, -7})},
                               {"all zero", Residuals(100, {0, 0, 0})},
                               {"narrow", gaussian(2000, 20, 1)},
                               {"wide", gaussian(2000, 300, 2)}};
    auto mixed = gaussian(2000, 25, 3);
    for (std::size_t k = 0; k < mixed.size(); k += 20) mixed[k][0] += 5000;
    out.push_back({"with outliers", mixed});
    auto flat = gaussian(2000, 100, 4);
    for (auto& e : flat) e[2] = 0;
    out.push_back({"flat", flat});
    return out;
}

// The bits of a choice by the code lengths, as the quantiser counts them. An escape adds those of its components.
double bits_of(const Codebook& codebook, std::size_t index, const ResidualVector& value) {
    double bits = codebook.lengths[index] / 8.0;
    if (index < codebook.codewords.size()) return bits;
    for (const auto c : value) {
        const auto n = static_cast<std::uint32_t>(std::abs(c / codebook.escape_step));
        bits += n == 0 ? 1.0 : 2.0 * static_cast<double>(std::bit_width(n)) + 0.5;
    }
    return bits;
}

double error(const ResidualVector& a, const ResidualVector& b) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += (1.0 * a[c] - b[c]) * (1.0 * a[c] - b[c]);
    return sum;
}

ResidualVector escaped(const ResidualVector& e, std::int32_t step) {
    ResidualVector out{};
    for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<std::int32_t>(std::llround(1.0 * e[c] / step)) * step;
    return out;
}

double total_bits(const Codebook& codebook, const QuantisedResiduals& quantised) {
    double bits = 0;
    for (std::size_t k = 0; k < quantised.indices.size(); ++k)
        bits += bits_of(codebook, quantised.indices[k], quantised.values[k]);
    return bits;
}

TEST(Quantiser, ChoosesAsBruteForceOverAllCodewordsAndTheEscape) {
    for (const double lambda : {0.0, 0.05, 0.12, 1.0, 50.0})
        for (const std::int32_t step : {1, 32, 64})
            for (const auto& source : sources()) {
                SCOPED_TRACE(source.name + ", lambda " + std::to_string(lambda) + ", step " + std::to_string(step));
                QuantiserOptions options;
                options.lambda = lambda;
                options.step = step;
                const auto codebook = train_codebook(source.residuals, options);
                const auto quantised = quantise(source.residuals, codebook, options);
                ASSERT_EQ(quantised.indices.size(), source.residuals.size());
                const double bit = lambda * step * step;
                for (std::size_t k = 0; k < source.residuals.size(); ++k) {
                    const auto& e = source.residuals[k];
                    const auto escape = escaped(e, codebook.escape_step);
                    double best = error(e, escape) + bit * bits_of(codebook, codebook.codewords.size(), escape);
                    for (std::size_t i = 0; i < codebook.codewords.size(); ++i)
                        best = std::min(best, error(e, codebook.codewords[i]) + bit * codebook.lengths[i] / 8.0);
                    const auto index = quantised.indices[k];
                    ASSERT_LE(index, codebook.codewords.size());
                    const auto& value = quantised.values[k];
                    EXPECT_EQ(value, index < codebook.codewords.size() ? codebook.codewords[index] : escape);
                    const double cost = error(e, value) + bit * bits_of(codebook, index, value);
                    // The search runs in floats: if choices differ by less than they resolve, either is right.
                    ASSERT_LE(cost, best * (1 + 1e-5) + 1e-9);
                }
            }
}

TEST(Quantiser, AResidualIsQuantisedTheSameWhereverItStands) {
    QuantiserOptions options;
    options.step = 4;
    for (const double deviation : {2.0, 10.0, 60.0}) {
        const auto residuals = gaussian(9000, deviation, 6);
        const auto codebook = train_codebook(residuals, options);
        const auto together = quantise(residuals, codebook, options);
        for (std::size_t k = 0; k < residuals.size(); k += 7) {
            const auto alone = quantise(Residuals{residuals[k]}, codebook, options);
            ASSERT_EQ(together.indices[k], alone.indices[0]);
            ASSERT_EQ(together.values[k], alone.values[0]);
        }
    }
}

TEST(Quantiser, LambdaZeroTakesTheNearest) {
    Codebook codebook;
    codebook.codewords = {{0, 0, 0}, {10, 0, 0}, {11, 0, 0}};
    codebook.lengths = {0, 100, 160, 160};
    codebook.escape_step = 1000;
    QuantiserOptions options;
    options.lambda = 0;
    const auto out = quantise(Residuals{{1, 0, 0}, {9, 1, 0}, {12, 0, 0}, {990, 10, 0}}, codebook, options);
    EXPECT_EQ(out.indices, (std::vector<std::uint16_t>{0, 1, 2, 3}));
    EXPECT_EQ(out.values[3], (ResidualVector{1000, 0, 0}));
}

TEST(Quantiser, AtLambdaZeroNoErrorIsAboveHalfTheDiagonalOfACell) {
    for (const std::int32_t step : {1, 2, 7, 64})
        for (const auto& source : sources()) {
            QuantiserOptions options;
            options.lambda = 0;
            options.step = step;
            const auto codebook = train_codebook(source.residuals, options);
            const auto out = quantise(source.residuals, codebook, options);
            for (std::size_t k = 0; k < source.residuals.size(); ++k)
                ASSERT_LE(error(source.residuals[k], out.values[k]), 0.75 * step * step * (1 + 1e-5)) << source.name;
        }
}

TEST(Quantiser, AnEmptyCodebookEscapesEverything) {
    Codebook codebook;
    codebook.lengths = {0};
    codebook.escape_step = 10;
    const auto out = quantise(Residuals{{14, -15, 4}, {0, 0, 0}}, codebook, {});
    EXPECT_EQ(out.indices, (std::vector<std::uint16_t>{0, 0}));
    EXPECT_EQ(out.values, (Residuals{{10, -20, 0}, {0, 0, 0}}));
}

TEST(Quantiser, RaisingLambdaNeverRaisesTheBits) {
    for (const auto& source : sources()) {
        const auto codebook = train_codebook(source.residuals, {});
        double before = INFINITY;
        for (const double lambda : {0.0, 0.01, 0.05, 0.12, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0}) {
            QuantiserOptions options;
            options.lambda = lambda;
            const double bits = total_bits(codebook, quantise(source.residuals, codebook, options));
            EXPECT_LE(bits, before + 1e-6) << source.name << ", lambda " << lambda;
            before = bits;
        }
    }
}

TEST(Quantiser, IsTheSameForAnyNumberOfThreads) {
    const auto residuals = gaussian(20000, 200, 5);
    QuantiserOptions one, seven;
    const ThreadPool pool(7);
    seven.threads = pool.threads();
    const auto codebook = train_codebook(residuals, one);
    EXPECT_EQ(train_codebook(residuals, seven), codebook);
    const auto a = quantise(residuals, codebook, one), b = quantise(residuals, codebook, seven);
    EXPECT_EQ(a.indices, b.indices);
    EXPECT_EQ(a.values, b.values);
}

TEST(Lagrangian, IsSquaredErrorPlusLambdaTimesBits) {
    Codebook codebook;
    codebook.codewords = {{0, 0, 0}};
    codebook.lengths = {8, 24};
    codebook.escape_step = 10;
    QuantiserOptions options;
    options.step = 10;
    options.lambda = 0.5;
    const Residuals residuals = {{1, 2, 3}, {31, 0, -9}};
    QuantisedResiduals quantised;
    quantised.indices = {0, 1};
    quantised.values = {{0, 0, 0}, {30, 0, -10}};
    const double escape_bits = 3 + (2 * 2 + 0.5) + 1 + (2 * 1 + 0.5);
    EXPECT_DOUBLE_EQ(lagrangian(residuals, quantised, codebook, options), 14 + 2 + 50 * (1 + escape_bits));
}

TEST(Training, GivesACodebookThatCanBeSent) {
    for (const auto& source : sources())
        for (const std::int32_t step : {1, 64, 1 << 24}) {
            QuantiserOptions options;
            options.step = step;
            const auto codebook = train_codebook(source.residuals, options);
            ASSERT_EQ(codebook.lengths.size(), codebook.codewords.size() + 1);
            EXPECT_EQ(codebook.escape_step, step);
            EXPECT_TRUE(std::is_sorted(codebook.lengths.begin(), codebook.lengths.end() - 1));
            const auto decoded = decode_codebook(encode_codebook(codebook));
            ASSERT_TRUE(decoded.has_value()) << source.name << ": " << decoded.error().message;
            EXPECT_EQ(*decoded, codebook);
        }
}

TEST(Training, DoesNotRaiseTheLagrangianAboveThatOfTheStartingLattice) {
    for (const double lambda : {0.05, 0.12, 0.5})
        for (const auto& source : sources()) {
            QuantiserOptions start, trained;
            start.lambda = trained.lambda = lambda;
            start.iterations = 0;
            const auto cost = [&](const QuantiserOptions& options) {
                const auto codebook = train_codebook(source.residuals, options);
                return lagrangian(source.residuals, quantise(source.residuals, codebook, options), codebook, options);
            };
            EXPECT_LE(cost(trained), cost(start) * (1 + 1e-9)) << source.name << ", lambda " << lambda;
        }
}

TEST(Training, KeepsNoCodewordForLessThanThreeResiduals) {
    EXPECT_TRUE(train_codebook(Residuals{{0, 0, 0}, {1, 0, 0}}, {}).codewords.empty());
    EXPECT_EQ(train_codebook(Residuals{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}).codewords.size(), 1u);
}

TEST(Training, IsBoundedByTheLargestCodebook) {
    QuantiserOptions options;
    options.step = 1;
    options.lambda = 0;
    Residuals residuals;
    for (std::int32_t i = 0; i < 6000; ++i) residuals.insert(residuals.end(), 3, {i, -i, 2 * i});
    options.training = 0;
    EXPECT_EQ(train_codebook(residuals, options).codewords.size(), max_codewords);
    EXPECT_EQ(quantise(residuals, train_codebook(residuals, options), options).values.back(), residuals.back());
}

}  // namespace
}  // namespace htvm::internal
