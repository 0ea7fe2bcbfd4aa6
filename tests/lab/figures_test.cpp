#include "figures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace htvm::lab {

namespace {

TEST(Histogram, counts_values_in_round_bars) {
    const std::vector<double> values = {1.0, 1.1, 1.1, 2.0, 2.9};
    const auto bars = histogram(values, 4);
    EXPECT_DOUBLE_EQ(0.5, bars.width);
    EXPECT_DOUBLE_EQ(1.0, bars.low);
    EXPECT_EQ((std::vector<std::uint64_t>{3, 0, 1, 1}), bars.counts);
    EXPECT_DOUBLE_EQ(1.62, bars.mean);
}

TEST(Histogram, equal_values_make_one_bar) {
    const std::vector<double> values = {3, 3, 3};
    const auto bars = histogram(values);
    EXPECT_EQ((std::vector<std::uint64_t>{3}), bars.counts);
    EXPECT_DOUBLE_EQ(3, bars.mean);
    EXPECT_LE(bars.low, 3);
    EXPECT_GE(bars.low + bars.width, 3);
}

TEST(Histogram, bars_are_no_narrower_than_asked) {
    const std::vector<double> values = {1.0, 1.01, 1.02};
    EXPECT_GE(histogram(values, 12, 0.3).width, 0.3);
}

TEST(Histogram, nothing_makes_no_bar) {
    EXPECT_TRUE(histogram({}).counts.empty());
    const std::vector<double> values = {std::nan(""), std::numeric_limits<double>::infinity()};
    EXPECT_TRUE(histogram(values).counts.empty());
}

TEST(Histogram, every_value_is_in_some_bar) {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        std::normal_distribution<double> normal(round - 100, std::pow(10, round % 7 - 3));
        std::vector<double> values(1 + random() % 50);
        for (auto& value : values) value = normal(random);
        const auto bars = histogram(values, 1 + round % 20);
        EXPECT_EQ(values.size(), std::accumulate(bars.counts.begin(), bars.counts.end(), std::uint64_t{0}));
        EXPECT_LE(bars.counts.size(), static_cast<std::size_t>(round % 20 + 3));
        for (const double value : values) {
            EXPECT_GE(value, bars.low - 1e-6 * bars.width);
            EXPECT_LE(value, bars.low + bars.width * (static_cast<double>(bars.counts.size()) + 1e-6));
        }
    }
}

}  // namespace
}  // namespace htvm::lab
