#include "codec/bones/mapping.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

using test::below;

std::size_t sum(const std::vector<std::uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

// For a reference mesh without triangles, which tells nothing about its vertices.
MappingPrior plain(std::size_t references) { return make_mapping_prior(std::vector<LatticePoint>(references), {}); }

std::vector<std::uint8_t> encode_plain(const std::vector<std::uint32_t>& counts) {
    return encode_mapping(counts, plain(counts.size()));
}

// Random triangles and positions: degenerate, duplicate, with many around one vertex.
MappingPrior random_prior(std::mt19937& random, std::size_t references) {
    std::vector<LatticePoint> positions(references);
    for (auto& p : positions) {
        const auto coordinate = [&] { return static_cast<std::int32_t>(below(random, 2000)) - 1000; };
        p = {coordinate(), coordinate(), coordinate()};
    }
    std::vector<Triangle> triangles(references > 0 ? below(random, 400) : 0);
    const auto n = static_cast<std::uint32_t>(references);
    for (auto& t : triangles) t = {below(random, n), below(random, n), below(random, 2) * (n - 1)};
    return make_mapping_prior(positions, triangles);
}

void expect_comes_back(const std::vector<std::uint32_t>& counts, const MappingPrior& prior) {
    const auto decoded = decode_mapping(encode_mapping(counts, prior), sum(counts), prior);
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
    EXPECT_TRUE(encode_plain({}).empty());
    EXPECT_TRUE(encode_plain(std::vector<std::uint32_t>(50, 0)).empty());
    EXPECT_TRUE(encode_plain(std::vector<std::uint32_t>{1234}).empty()) << "all belong to the only reference vertex";
    EXPECT_EQ(*decode_mapping({}, 0, plain(0)), std::vector<std::uint32_t>{});
    EXPECT_EQ(*decode_mapping({}, 0, plain(3)), (std::vector<std::uint32_t>{0, 0, 0}));
    EXPECT_EQ(*decode_mapping({}, 1234, plain(1)), std::vector<std::uint32_t>{1234});
}

TEST(Mapping, ComesBack) {
    for (const auto& counts : std::vector<std::vector<std::uint32_t>>{
             {1}, {0, 1}, {1, 0}, {0, 0, 7}, {7, 0, 0}, {1, 1, 1, 1}, {0, 5, 0, 5}, {100000, 0, 3}, {0, 100000}})
        expect_comes_back(counts, plain(counts.size()));
    std::mt19937 random(1);
    for (int i = 0; i < 300; ++i) {
        const auto counts = random_counts(random);
        expect_comes_back(counts, random_prior(random, counts.size()));
    }
}

TEST(Mapping, OneResidualEachCostsNextToNothing) {
    EXPECT_LT(encode_plain(std::vector<std::uint32_t>(10000, 1)).size(), 100u);
}

TEST(Mapping, StaysBelowTheBoundOfThePaper) {
    // Section IV-C3: one bit per node, N_I + N_t nodes; adaptive coding may add a little.
    std::mt19937 random(2);
    std::vector<std::uint32_t> counts(10000);
    for (auto& n : counts) n = below(random, 2) + below(random, 2);
    EXPECT_LT(8 * encode_plain(counts).size(), (counts.size() + sum(counts)) * 102 / 100);
}

TEST(Mapping, AreasAreClassedAgainstTheirMean) {
    // A small and a large triangle: areas 50 and 5000, so the corners have 0.02 and 1.98 times the mean.
    const std::vector<LatticePoint> positions = {{0, 0, 0}, {10, 0, 0},  {0, 10, 0},
                                                 {0, 0, 5}, {100, 0, 5}, {0, 100, 5}};
    const auto prior = make_mapping_prior(positions, std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}});
    EXPECT_EQ(prior.area_class, (std::vector<std::uint8_t>{0, 0, 0, 8, 8, 8}));
    // The next corner of each corner, if its index is lower.
    EXPECT_EQ(prior.first_neighbour, (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 1, 2}));
    EXPECT_EQ(prior.neighbours, (std::vector<std::uint32_t>{0, 3}));
}

TEST(Mapping, DamageGivesAnErrorOrAsManyResidualsAsAsked) {
    std::mt19937 random(3);
    for (int i = 0; i < 10; ++i) {
        const auto counts = random_counts(random);
        const std::size_t references = counts.size(), residuals = sum(counts);
        const auto prior = random_prior(random, references);
        hostile::try_everything(
            encode_mapping(counts, prior),
            [&](const std::vector<std::uint8_t>& bytes) {
                const auto decoded = decode_mapping(bytes, residuals, prior);
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
}  // namespace htvm::internal
