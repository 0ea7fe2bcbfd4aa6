#include "metrics/bjontegaard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace htvm {
namespace {

using Curve = std::vector<RatePoint>;

double random_in(std::mt19937& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

// A typical coder: the error halves for every 3 bits.
Curve typical(double factor = 1) {
    Curve curve;
    for (const double error : {4.0, 2.0, 1.0, 0.5, 0.25})
        curve.push_back({factor * (6 - 3 * std::log2(error)), quality_of_error(error)});
    return curve;
}

TEST(Bjontegaard, identical_curves_differ_by_nothing) {
    const auto curve = typical();
    EXPECT_DOUBLE_EQ(0, *bjontegaard_rate_difference(curve, curve));
}

TEST(Bjontegaard, curve_at_twice_the_rate_costs_100_percent_more) {
    EXPECT_NEAR(1, *bjontegaard_rate_difference(typical(), typical(2)), 1e-12);
    EXPECT_NEAR(-0.5, *bjontegaard_rate_difference(typical(2), typical()), 1e-12);
}

TEST(Bjontegaard, a_tenth_of_the_bits_is_minus_90_percent) {
    EXPECT_NEAR(-0.9, *bjontegaard_rate_difference(typical(), typical(0.1)), 1e-12);
}

TEST(Bjontegaard, two_points_are_a_straight_line_in_the_logarithm) {
    // Over the common range 1..2 the ratio of the rates goes from 1 to 4: the mean of its logarithm is ln 2.
    const Curve reference{{1, 0}, {1, 2}}, tested{{1, 1}, {4, 2}};
    EXPECT_NEAR(1, *bjontegaard_rate_difference(reference, tested), 1e-12);
}

TEST(Bjontegaard, averages_over_the_common_qualities_alone) {
    // The tested curve takes twice the bits where both exist; its rates elsewhere do not count.
    const Curve reference{{1, 10}, {1, 20}}, tested{{100, 0}, {2, 10}, {2, 15}, {2, 20}, {2, 25}};
    EXPECT_NEAR(1, *bjontegaard_rate_difference(reference, tested), 1e-9);
}

TEST(Bjontegaard, is_not_available_without_common_qualities) {
    const Curve low{{1, 10}, {2, 20}}, high{{3, 30}, {4, 40}}, touching{{3, 20}, {4, 30}};
    EXPECT_FALSE(bjontegaard_rate_difference(low, high));
    EXPECT_FALSE(bjontegaard_rate_difference(high, low));
    EXPECT_FALSE(bjontegaard_rate_difference(low, touching));
}

TEST(Bjontegaard, is_not_available_for_fewer_than_two_usable_points) {
    const auto curve = typical();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(bjontegaard_rate_difference(curve, Curve{}));
    EXPECT_FALSE(bjontegaard_rate_difference(curve, Curve{{5, 0}}));
    EXPECT_FALSE(bjontegaard_rate_difference(curve, Curve{{5, 0}, {6, 0}}));
    EXPECT_FALSE(bjontegaard_rate_difference(curve, Curve{{5, 0}, {6, infinity}}));
    EXPECT_FALSE(bjontegaard_rate_difference(curve, Curve{{5, 0}, {0, 1}}));
}

TEST(Bjontegaard, lossless_points_are_left_out) {
    auto with_lossless = typical(2);
    with_lossless.push_back({60, quality_of_error(0)});
    EXPECT_NEAR(1, *bjontegaard_rate_difference(typical(), with_lossless), 1e-12);
}

TEST(Bjontegaard, of_equal_qualities_the_cheapest_counts) {
    auto twice = typical();
    for (const auto& p : typical(5)) twice.push_back(p);
    EXPECT_NEAR(0, *bjontegaard_rate_difference(typical(), twice), 1e-12);
}

TEST(Bjontegaard, does_not_depend_on_the_order_of_points_or_the_unit_of_rate) {
    std::mt19937 random(5);
    for (int round = 0; round < 50; ++round) {
        Curve a, b;
        for (int i = 0; i < 6; ++i) {
            a.push_back({random_in(random, 1, 100), i + random_in(random, 0, 0.9)});
            b.push_back({random_in(random, 1, 100), i + random_in(random, 0, 0.9)});
        }
        const double expected = *bjontegaard_rate_difference(a, b);
        std::shuffle(a.begin(), a.end(), random);
        for (auto& p : a) p.rate *= 7;
        for (auto& p : b) p.rate *= 7;
        EXPECT_NEAR(expected, *bjontegaard_rate_difference(a, b), 1e-9 * (1 + std::abs(expected)));
        // Swapping the curves inverts the ratio.
        EXPECT_NEAR(1, (1 + expected) * (1 + *bjontegaard_rate_difference(b, a)), 1e-9);
    }
}

TEST(QualityAtRate, passes_through_the_points_and_never_leaves_their_range_between) {
    std::mt19937 random(6);
    for (int round = 0; round < 50; ++round) {
        Curve curve;
        double rate = 1;
        for (int i = 0; i < 6; ++i) {
            rate += random_in(random, 0.1, 3);
            curve.push_back({rate, random_in(random, 0, 10)});
        }
        for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
            EXPECT_NEAR(curve[i].quality, *quality_at_rate(curve, curve[i].rate), 1e-9);
            const auto [low, high] = std::minmax(curve[i].quality, curve[i + 1].quality);
            for (int k = 1; k < 10; ++k) {
                const double between = curve[i].rate + (curve[i + 1].rate - curve[i].rate) * k / 10;
                const double quality = *quality_at_rate(curve, between);
                EXPECT_GE(quality, low - 1e-9);
                EXPECT_LE(quality, high + 1e-9);
            }
        }
    }
}

TEST(QualityAtRate, is_not_known_outside_the_points) {
    const Curve curve{{2, 1}, {4, 2}};
    EXPECT_FALSE(quality_at_rate(curve, 1.9));
    EXPECT_FALSE(quality_at_rate(curve, 4.1));
    EXPECT_FALSE(quality_at_rate(curve, 0));
    EXPECT_FALSE(quality_at_rate(curve, -1));
    EXPECT_FALSE(quality_at_rate(Curve{}, 3));
}

TEST(CurveCrossings, straight_lines_cross_where_they_meet) {
    // Over ln(rate) from ln 1 to ln 16: one rises from 0 to 4, the other from 1 to 3; they meet halfway, at rate 4.
    const Curve steep{{1, 0}, {16, 4}}, flat{{1, 1}, {16, 3}};
    const auto crossings = curve_crossings(flat, steep);
    ASSERT_EQ(1u, crossings.size());
    EXPECT_NEAR(4, crossings[0].rate, 1e-9);
    EXPECT_NEAR(2, crossings[0].quality, 1e-9);
    EXPECT_TRUE(crossings[0].first_ahead_below);
    const auto other_way = curve_crossings(steep, flat);
    ASSERT_EQ(1u, other_way.size());
    EXPECT_FALSE(other_way[0].first_ahead_below);
}

TEST(CurveCrossings, curves_that_never_meet_do_not_cross) {
    EXPECT_TRUE(curve_crossings(typical(), typical(2)).empty());
    EXPECT_TRUE(curve_crossings(typical(), typical()).empty());
    EXPECT_TRUE(curve_crossings(Curve{{1, 0}, {2, 1}}, Curve{{3, 1}, {4, 0}}).empty());
    EXPECT_TRUE(curve_crossings(typical(), Curve{}).empty());
}

TEST(CurveCrossings, finds_every_crossing_by_rising_rate) {
    const Curve zigzag{{1, 0}, {2, 2}, {4, 0}, {8, 2}}, level{{1, 1}, {8, 1}};
    const auto crossings = curve_crossings(zigzag, level);
    ASSERT_EQ(3u, crossings.size());
    EXPECT_FALSE(crossings[0].first_ahead_below);
    EXPECT_TRUE(crossings[1].first_ahead_below);
    EXPECT_FALSE(crossings[2].first_ahead_below);
    EXPECT_LT(crossings[0].rate, crossings[1].rate);
    EXPECT_LT(crossings[1].rate, crossings[2].rate);
}

}  // namespace
}  // namespace htvm
