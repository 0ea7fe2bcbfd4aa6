#include "findings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace htvm::lab {

namespace {

using ::testing::HasSubstr;

// One frame of 8000 vertices, so that a byte is a thousandth of a bit per vertex.
RdPoint point_of(const std::string& coder, double rate, double m1, double step) {
    RdPoint point;
    point.coder = coder;
    point.geometry_step = step;
    RdFrame frame;
    frame.vertices = 8000;
    frame.bytes[Layer::geometry] = static_cast<std::size_t>(std::lround(1000 * rate));
    point.frames = {frame};
    point.values["m1_mm"] = m1;
    return point;
}

// M1 over rate falls like 4 mm / rate for TFAN, and more slowly for the paper's coder: equal at 4 bpvf.
std::vector<RdPoint> crossing_curves() {
    std::vector<RdPoint> points;
    for (const double rate : {1.0, 2.0, 4.0, 8.0, 16.0}) {
        points.push_back(point_of("tfan", rate, 4 / rate, 16 / rate));
        points.push_back(point_of("paper", rate, 2 / std::sqrt(rate), 8 / rate));
    }
    return points;
}

TEST(Contest, finds_where_the_lead_changes) {
    const auto found = contest(crossing_curves(), "paper", "tfan", "m1_mm");
    ASSERT_EQ(1u, found.crossings.size());
    EXPECT_NEAR(4, found.crossings[0].rate, 1e-6);
    EXPECT_TRUE(found.crossings[0].first_ahead_below);
    EXPECT_NEAR(4, *ahead_below(found), 1e-6);
    EXPECT_THAT(contest_sentence(found, "paper", "tfan", "m1_mm"),
                HasSubstr("The paper's coder is ahead of our TFAN below 4.0 bpvf (at 1.00 mm), and behind above."));
    EXPECT_EQ("ahead below 4.0 bpvf", contest_phrase(found));
}

TEST(Contest, seen_from_the_other_side_it_is_not_ahead_below) {
    const auto found = contest(crossing_curves(), "tfan", "paper", "m1_mm");
    EXPECT_FALSE(ahead_below(found));
    EXPECT_EQ("behind below 4.0 bpvf", contest_phrase(found));
}

TEST(Contest, a_coder_ahead_everywhere_is_ahead_below_any_rate) {
    std::vector<RdPoint> points;
    for (const double rate : {1.0, 2.0, 4.0}) {
        points.push_back(point_of("paper", rate, 1 / rate, 1));
        points.push_back(point_of("tfan", 2 * rate, 1 / rate, 1));
    }
    const auto found = contest(points, "paper", "tfan", "m1_mm");
    EXPECT_TRUE(std::isinf(*ahead_below(found)));
    EXPECT_NEAR(-0.5, *found.rate_difference, 1e-9);
    const auto sentence = contest_sentence(found, "paper", "tfan", "m1_mm");
    EXPECT_THAT(sentence, HasSubstr("at every rate that both reach"));
    EXPECT_THAT(sentence, HasSubstr("50.0 % fewer bits"));
    EXPECT_THAT(contest_sentence(contest(points, "tfan", "paper", "m1_mm"), "tfan", "paper", "m1_mm"),
                HasSubstr("The paper's coder is ahead of our TFAN at every rate"));
}

TEST(Contest, coders_that_share_no_rates_are_not_compared) {
    std::vector<RdPoint> points = {point_of("paper", 1, 2, 1), point_of("paper", 2, 1, 1), point_of("tfan", 5, 2, 1),
                                   point_of("tfan", 6, 1, 1)};
    const auto found = contest(points, "paper", "tfan", "m1_mm");
    EXPECT_EQ("no common rates", contest_phrase(found));
    EXPECT_FALSE(ahead_below(found));
    EXPECT_TRUE(matched_rates(points, "paper", "tfan", 3, 12).empty());
    EXPECT_EQ("no common rates", contest_phrase(contest({}, "paper", "tfan", "m1_mm")));
}

TEST(BitsPhrase, says_more_or_fewer) {
    EXPECT_EQ("12.3 % fewer bits", bits_phrase(-0.123));
    EXPECT_EQ("4.0 % more bits", bits_phrase(0.04));
    EXPECT_EQ("as many bits", bits_phrase(0.0001));
}

TEST(MatchedRates, lie_in_the_range_of_both_in_equal_factors) {
    const auto rates = matched_rates(crossing_curves(), "paper", "tfan", 3, 12);
    ASSERT_EQ(3u, rates.size());
    EXPECT_NEAR(1.02, rates[0], 1e-12);
    EXPECT_NEAR(12, rates[2], 1e-12);
    EXPECT_NEAR(rates[1] / rates[0], rates[2] / rates[1], 1e-12);
}

TEST(GeometryStep, is_read_off_between_the_points) {
    const auto points = crossing_curves();
    EXPECT_NEAR(16 / 3.0, *geometry_step_at_rate(points, "tfan", 3), 1e-9);
    EXPECT_FALSE(geometry_step_at_rate(points, "tfan", 17));
    EXPECT_FALSE(geometry_step_at_rate(points, "draco10", 3));
}

}  // namespace
}  // namespace htvm::lab
